"""The stops of a robot: raised and cleared by its watches, and what they let through of a command."""

import math
from collections.abc import Iterable

import numpy as np

from refseq_bench.robots.motion import Twist
from refseq_bench.robots.signals import Signals
from refseq_bench.robots.state import LATCHED, Blocked, Cause, Stop

TIPPED_PITCH = math.radians(45)
TIPPED_ROLL = math.radians(60)
"""Beyond these a robot has tipped over: those of the RMP 200 (README there)."""

STUCK_TIME = 1.0
"""A wheel that is pushed as hard as its motor can and has not turned for so long [s] is stuck: a choice."""
STUCK_TORQUE = 0.9
"""Share of the motor's limit that counts as pushed: a choice."""


class Stops:
    """All stops that hold at present."""

    def __init__(self) -> None:
        self._held: dict[Cause, Stop] = {}

    @property
    def held(self) -> tuple[Stop, ...]:
        """In the order in which they came."""
        return tuple(self._held.values())

    def __contains__(self, cause: Cause) -> bool:
        return cause in self._held

    def set(self, cause: Cause, detail: str | None, time: float, blocks: Blocked = Blocked.ALL) -> None:
        """Raise the stop of a cause where there is a ``detail``, else clear it unless it is latched.

        A stop that holds keeps its time; its detail too where it is latched: what came first tells more.
        """
        if detail is None and not self._held:
            return
        before = self._held.get(cause)
        if detail is None:
            if cause not in LATCHED:
                self._held.pop(cause, None)
        elif before is None:
            self._held[cause] = Stop(cause, detail, time, blocks)
        elif cause not in LATCHED:
            self._held[cause] = Stop(cause, detail, before.since, blocks)

    def release(self) -> None:
        """Clear all; what still has its reason is raised again at the next look."""
        self._held.clear()

    def allowed(self, twist: Twist) -> Twist:
        """Return what the stops let through of a command."""
        return let_through(self._held.values(), twist)


class StopLog:
    """All stops that held at some time, each once, in the order in which they came."""

    def __init__(self) -> None:
        self._heard: dict[tuple[Cause, float], Stop] = {}

    @property
    def heard(self) -> tuple[Stop, ...]:
        """All of them."""
        return tuple(self._heard.values())

    def hear(self, stops: Iterable[Stop]) -> None:
        """Note those that hold now."""
        for stop in stops:
            self._heard.setdefault((stop.cause, stop.since), stop)


def let_through(stops: Iterable[Stop], twist: Twist) -> Twist:
    """Return what ``stops`` let through of a command: all, nothing, or turning and going the other way."""
    blocked = {stop.blocks for stop in stops}
    if not blocked:
        return twist
    if Blocked.ALL in blocked:
        return Twist()
    linear = twist.linear
    if Blocked.FORWARD in blocked:
        linear = min(linear, 0.0)
    if Blocked.BACKWARD in blocked:
        linear = max(linear, 0.0)
    return Twist(linear, twist.angular)


def tipped(signals: Signals) -> str | None:
    """Tell how far the robot lies over, None while it stands."""
    pitch, roll = signals.inertial.pitch, signals.inertial.roll
    if abs(pitch) > TIPPED_PITCH or abs(roll) > TIPPED_ROLL:
        return f"pitch {math.degrees(pitch):.0f}°, roll {math.degrees(roll):.0f}°"
    return None  # also for what is no number, which is another watch's


def not_a_number(signals: Signals) -> str | None:
    """Name the sensor of which a reading is no number, None where all are.

    A range of infinity is none: nothing came back.
    """
    if not signals.inertial.finite:
        return "inertial sensors read no number"
    if not signals.pulses.finite:
        return "encoders read no number"
    if signals.sonar is not None and np.isnan(signals.sonar).any():
        return f"sonar {int(np.argmax(np.isnan(signals.sonar)))} reads no number"
    if signals.scan is not None and np.isnan(signals.scan.ranges).any():
        return f"laser beam {int(np.argmax(np.isnan(signals.scan.ranges)))} reads no number"
    return None


class StuckWatch:
    """Tells of a wheel that does not turn although its motor gives nearly all of ``limit`` [N·m].

    What turns by fewer than ``slack`` pulses stands still: tyres and gears give way a little.
    """

    def __init__(self, limit: float, slack: float) -> None:
        self._enough, self._slack = STUCK_TORQUE * limit, slack
        self._since: list[tuple[float, float] | None] = [None, None]  # time and counter when the pushing began

    def look(self, signals: Signals) -> str | None:
        """Tell which wheel is stuck now, None when both are free."""
        for side, name in enumerate(("left", "right")):
            torque, count = signals.torques[side], signals.pulses[side]
            since = self._since[side]
            if abs(torque) < self._enough:
                self._since[side] = None
            elif since is None or abs(count - since[1]) > self._slack:
                self._since[side] = signals.time, count
            elif signals.time - since[0] >= STUCK_TIME:
                return f"{name} wheel stands still at {torque:.0f} N·m"
        return None
