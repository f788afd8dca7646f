"""Recording a drive: a scripted operator leads the robot, views are taken when their trigger says so."""

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version

import numpy as np

from refseq.planar import Pose, wrap
from refseq.view import View
from refseq_bench.sim.bench.bench import CONTROL_PERIOD, Bench
from refseq_bench.sim.bench.contacts import ContactLog, thing_in_words
from refseq_bench.sim.bench.faults import Fault, FaultSchedule
from refseq_bench.sim.drives.operator import Operator, OperatorStyle
from refseq_bench.sim.errors import SimError, StuckError

PACKAGES = ("refseq-bench", "mujoco", "numpy", "opencv-python-headless")


ROUNDING = 1e-9
"""Share by which a sum of control periods may miss the time that they last: ten of 0.04 s make less than 0.4 s."""
LEARNT_EVERY = 0.85
"""A view is taken so often [m] where nothing else is asked for, and then becomes a place."""
MISSION_EVERY = 0.6
"""On a mission a view is taken so often [m]: a choice, other than ``LEARNT_EVERY``.

Views as far apart as places would meet each of them the same way, and never tell that the robot is between two."""


@dataclass(frozen=True, slots=True)
class Trigger:
    """A view is taken when the odometer has gone ``distance`` [m] or turned ``turn`` [rad], or after ``time`` [s].

    None switches one off. Raises ``SimError`` when a threshold is not positive, or when all are off.
    """

    distance: float | None = LEARNT_EVERY
    turn: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        given = asdict(self)
        if all(value is None for value in given.values()):
            raise SimError("trigger: distance, turn and time are all off; valid is at least one of them")
        for name, value in given.items():
            if value is not None and not 0 < value < np.inf:
                raise SimError(f"trigger: {name} = {value} is not positive and finite")

    def fires(self, moved: "Moved") -> bool:
        """True if so much motion calls for a view."""
        pairs = ((self.distance, moved.distance), (self.turn, abs(moved.turn)), (self.time, moved.time))
        return any(limit is not None and value >= limit * (1 - ROUNDING) for limit, value in pairs)


@dataclass(slots=True)
class Moved:
    """Motion by the odometer since the last view: path length [m], turn [rad], time [s]."""

    distance: float = 0.0
    turn: float = 0.0
    time: float = 0.0

    def add(self, before: Pose, after: Pose, elapsed: float) -> None:
        """Count one control period on."""
        self.distance += float(np.hypot(after.x - before.x, after.y - before.y))
        self.turn += wrap(after.heading - before.heading)
        self.time += elapsed


STANDSTILL, STEP = 120.0, 0.1
"""An operator whose robot has come no ``STEP`` [m] further or back along the route for so long gives up [s]."""


REACH = 0.5
"""A thing that is farther from a robot [m] is none that it is stuck at: its stops end sooner. A choice."""


@dataclass(slots=True)
class Standstill:
    """Since when, ``time`` [s], a robot has been about as far along its route as then, ``progress`` [m]."""

    progress: float
    time: float

    def too_long(self, progress: float, time: float) -> bool:
        """True when it is no ``STEP`` from there after ``STANDSTILL``."""
        if abs(progress - self.progress) >= STEP:
            self.progress, self.time = progress, time
        return time - self.time > STANDSTILL


@dataclass(frozen=True, slots=True)
class RecordedView:
    """A view, the odometer's pose where it was taken, and how far along the route the robot has come [m]."""

    view: View
    odometry: Pose
    progress: float


PATIENCE = 3600.0
"""For how long the operator tries to get to the end, where nothing else is asked for [s of simulated time]."""


def record(
    bench: Bench,
    operator: Operator | None = None,
    trigger: Trigger | None = None,
    *,
    faults: Sequence[Fault] = (),
    timeout: float = PATIENCE,
) -> Iterator[View]:
    """Lead the robot of ``bench`` along a route; yields the views as they are taken, the first at the start.

    The route is the bench's, which the operator of seed 0 follows, unless an ``operator`` of your own brings another;
    ``trigger`` says when a view is taken, by default every 0.85 m. A ``refseq.logs.RecordingWriter`` writes the views
    to a file. Raises as ``drive_and_sense`` does, which also tells how far the robot has come.
    """
    taken = drive_and_sense(
        bench, operator or operator_for(bench, 0), trigger or Trigger(), faults=faults, timeout=timeout
    )
    return (one.view for one in taken)


def drive_and_sense(
    bench: Bench, operator: Operator, trigger: Trigger, *, faults: Sequence[Fault] = (), timeout: float = PATIENCE
) -> Iterator[RecordedView]:
    """Lead the robot to the end of the operator's route; yields the views as they are taken, the first at the start.

    ``faults`` happen on the way. Raises ``StuckError`` when the end is not reached within ``timeout`` [s] of simulated
    time from now on or the robot comes no further for ``STANDSTILL``, ``SimError`` for a fault that cannot happen on
    this route to this robot.
    """
    began, agenda = bench.time, FaultSchedule(faults, bench, operator)
    agenda.look()
    yield RecordedView(bench.sense(), bench.odometry, operator.progress)
    moved, stands = Moved(), Standstill(operator.progress, bench.time)
    while not operator.finished:
        before = bench.odometry
        bench.drive(operator.command(bench.time, bench.pose))
        agenda.look()
        moved.add(before, bench.odometry, CONTROL_PERIOD)
        if trigger.fires(moved):
            yield RecordedView(bench.sense(), bench.odometry, operator.progress)
            moved = Moved()
        lasted = bench.time - began
        if lasted > timeout or stands.too_long(operator.progress, bench.time):
            way = f"{operator.progress:.1f} m of {operator.length:.1f} m"
            raise StuckError(f"the robot came {way} in {lasted:.0f} s: it is stuck at {_stuck_at(bench)}")


def _stuck_at(bench: Bench) -> str:
    """Where the robot stands, and the thing ahead that is within reach, if any."""
    near = ContactLog(bench).nearest_ahead(REACH)
    before = f", {max(0.0, near.gap):.2f} m before {thing_in_words(near.name)}" if near else ""
    return f"x {bench.pose.x:.2f}, y {bench.pose.y:.2f}{before} (refseq world check tells what stands on a route)"


def operator_for(bench: Bench, seed: int, style: OperatorStyle | None = None) -> Operator:
    """The person who leads the robot along the bench's route; another ``seed`` is another drive of the same person."""
    return Operator(bench.route, style or OperatorStyle(), np.random.default_rng((OPERATOR_STREAM, seed)))


OPERATOR_STREAM = 5
"""Keeps the operator's random numbers apart from those of the sensors, which come from the same seed."""


def describe(
    bench: Bench, *, route: str, seed: int, trigger: Trigger | None, style: OperatorStyle | None
) -> Mapping[str, str]:
    """The metadata record of a drive: all that is needed to drive it again.

    ``trigger`` None: views were asked for by hand; ``style`` None: it was no operator who led.
    """
    config = {
        "light": asdict(bench.world.light),
        "plan": bench.world.plan.model_dump(mode="json"),
        "sensors": asdict(bench.settings),
        "operator": asdict(style) if style else None,
        "trigger": asdict(trigger) if trigger else None,
        "timestep_s": bench.model.opt.timestep,
    }
    return {
        "world": bench.world.name,
        "world_seed": str(bench.world.seed),
        "light": bench.world.light.name,
        "robot": bench.robot.name,
        "route": route,
        "seed": str(seed),
        "renderer": bench.renderer.kind.value,
        "python": platform.python_version(),
        **{package: version(package) for package in PACKAGES},
        "config": json.dumps(config, default=str, sort_keys=True),
    }
