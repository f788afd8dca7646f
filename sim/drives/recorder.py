"""Recording a drive: a scripted operator leads the robot, views are taken when their trigger says so."""

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version

import numpy as np

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.contacts import ContactLog, thing_in_words
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.faults import Fault, FaultSchedule
from refseq_bench.sim.drives.operator import PATIENCE, Operator, OperatorStyle
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.errors import StuckError

PACKAGES = ("refseq-bench", "mujoco", "numpy", "opencv-python-headless")


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
