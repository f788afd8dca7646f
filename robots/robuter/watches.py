"""Watches that stop the Robuter: front sonars and bumpers."""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.motion import Limits, Twist
from refseq_bench.robots.robuter.protocol import Bumper
from refseq_bench.robots.state import Blocked

MARGIN = 0.25
"""Room left in front of the sonars when it has stopped [m]: a choice; the front bumper stands 6 cm further out."""
ROUND = 0.4
"""No sonar is silent for so long [s]: a round of all groups takes 0.373 s (``refseq_bench.sim.sensors.sonar``)."""
REACTION = 0.5
"""Time that the robot goes on before it brakes [s]: a round of the sonars, two ticks, the motors' lag."""
HYSTERESIS = 0.1
"""Room that there has to be on top until it goes on [m]: two deviations of a sonar's reading."""

_WAYS = {Bumper.FRONT: Blocked.FORWARD, Bumper.REAR: Blocked.BACKWARD}


class SonarWatch:
    """Tells of an obstacle ahead, nearer than the robot needs to stop at the speed that it has or is asked for."""

    def __init__(self, front: Sequence[int], limits: Limits) -> None:
        self._front, self._braking = list(front), limits.acceleration
        self._since: dict[int, float] = {}  # since when a sonar has seen something near
        self._last: tuple[float, str] | None = None  # when something was last in the way, and what

    def room(self, speed: float) -> float:
        """Return how much room ahead a ``speed`` [m/s] needs [m]: way until it brakes, braking distance, margin."""
        ahead = max(speed, 0.0)
        return MARGIN + ahead * REACTION + ahead * ahead / (2 * self._braking)

    def look(self, time: float, ranges: NDArray[np.float64] | None, speed: float) -> str | None:
        """Tell what is in the way at ``speed`` [m/s], None while nothing is.

        It takes two readings, as one may be a stray echo: of two sonars, or of one that has had time for another.
        """
        if ranges is None:
            return None
        room = self.room(speed) + (HYSTERESIS if self._last is not None else 0.0)
        near = {i: float(ranges[i]) for i in self._front if ranges[i] < room}
        self._since = {i: self._since.get(i, time) for i in near}
        if len(near) > 1 or any(time - since > ROUND for since in self._since.values()):
            self._last = time, f"{min(near.values()):.2f} m ahead, {room:.2f} m needed"
        elif self._last is not None and time - self._last[0] > ROUND:
            self._last = None
        return self._last[1] if self._last else None


class BumperWatch:
    """Tells which bumpers are pressed, or were and would be again by what is asked for.

    A robot that bumps rebounds: if it went on as soon as the bumper is free it would knock again and again.
    """

    def __init__(self) -> None:
        self._hit: frozenset[Bumper] = frozenset()

    def look(self, pressed: Collection[str], wanted: Twist) -> str | None:
        """Tell the bumpers, None when the way is free."""
        if not (pressed or self._hit):
            return None
        self._hit = frozenset(map(Bumper, pressed)) | {one for one in self._hit if _into(one, wanted)}
        return ", ".join(bumper.value for bumper in Bumper if bumper in self._hit) or None

    @property
    def blocks(self) -> Blocked:
        """The way that is forbidden."""
        ways = {_WAYS[bumper] for bumper in self._hit}
        return ways.pop() if len(ways) == 1 else Blocked.ALL


def _into(bumper: Bumper, wanted: Twist) -> bool:
    return wanted.linear > 0 if bumper is Bumper.FRONT else wanted.linear < 0
