"""Running behaviours on a bench: what they have to know of the robot, and each until it ends or its time is up."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench.robots import Robot
from refseq_bench.robots.behaviours import (
    Behaviour,
    BehaviourOutcome,
    BehaviourStep,
    Ranger,
    RobotDescription,
    Senses,
    failed,
)
from refseq_bench.robots.behaviours.written import make_behaviour, parse_behaviour
from refseq_bench.robots.mounting import Mounting
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.doors import doors_seen


@dataclass(frozen=True, slots=True)
class BehaviourMoment:
    """One period of a behaviour: the ``step`` that it asked for, then the true ``pose`` at ``time`` [s] after it."""

    time: float
    step: BehaviourStep
    pose: Pose


@dataclass(frozen=True, slots=True)
class BehaviourEnd:
    """End of a behaviour: outcome and reason, how long it took [s], and the true ``path`` (n, 3): x, y, heading."""

    outcome: BehaviourOutcome
    why: str
    time: float
    path: NDArray[np.float64]


def description_of(robot: Robot) -> RobotDescription:
    """Describe a robot for behaviours; sensors are where they are on the level robot."""
    model = robot.spec.copy().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    base, scanner = data.body(robot.base).xpos, data.site(robot.laser).xpos
    laser = Mounting(float(scanner[0] - base[0]), float(scanner[2]), robot.drive.wheel_radius)
    sonars = (data.site(name) for name in robot.sonars)
    rangers = tuple(_ranger(sonar.xpos - base, sonar.xmat.reshape(3, 3)[:, 0]) for sonar in sonars)
    return RobotDescription(robot.shape, robot.limits, laser, rangers)


def behaviour_in(words: str, description: RobotDescription) -> Behaviour:
    """A behaviour as it is written, for a robot on a bench. Raises ``RobotsError`` for what this robot cannot do."""
    return make_behaviour(parse_behaviour(words), description, doors_seen)


def senses_of(bench: Bench) -> Senses:
    """Senses of the robot now, to steer by: its state, the newest turn of the laser, the time."""
    return Senses(bench.state, bench.scan(), bench.time)


class RunningBehaviour:
    """The behaviour of an order on its way, for a robot on a bench; another number begins another one.

    Its clock stands while it is ``halted``: a pause wears out no behaviour's patience.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._description = description
        self._running: tuple[int, Behaviour] | None = None
        self._halted = 0.0  # time for which the running one was halted [s]

    def step(self, number: int, words: str, senses: Senses) -> BehaviourStep:
        """A step of the running behaviour, or of a new one for another ``number``. Raises as ``behaviour_in``."""
        if self._running is None or self._running[0] != number:
            self._running, self._halted = (number, behaviour_in(words, self._description)), 0.0
        if self._halted:
            state = replace(senses.state, time=senses.state.time - self._halted)
            senses = replace(senses, state=state, time=senses.now - self._halted)
        return self._running[1].step(senses)

    def halted(self, seconds: float) -> None:
        """The robot has stood for so long by another's will."""
        self._halted += seconds


def _ranger(place: NDArray[np.float64], axis: NDArray[np.float64]) -> Ranger:
    return Ranger(float(place[0]), float(place[1]), math.atan2(axis[1], axis[0]))


def running(
    bench: Bench, behaviour: Behaviour, *, timeout: float = 120.0, since: float | None = None
) -> Iterator[BehaviourMoment]:
    """Let ``behaviour`` steer, and tell of each control period.

    The last moment's step has the outcome; when ``timeout`` [s] of simulated time have passed ``since`` then, or since
    now, that is a failure.
    """
    began = bench.time if since is None else since
    while True:
        step = behaviour.step(senses_of(bench))
        if step.outcome is BehaviourOutcome.RUNNING and bench.time - began >= timeout:
            step = failed(f"not done after {timeout:g} s" + (f": {step.why}" if step.why else ""))
        bench.drive(step.twist)
        yield BehaviourMoment(bench.time, step, bench.pose)
        if step.outcome is not BehaviourOutcome.RUNNING:
            return


def run(
    bench: Bench,
    behaviour: Behaviour,
    *,
    timeout: float = 120.0,
    each: Callable[[BehaviourMoment], None] | None = None,
) -> BehaviourEnd:
    """Let ``behaviour`` steer until it ends, and call ``each`` after every control period; see ``running``."""
    began, path = bench.time, [bench.pose]
    for sample in running(bench, behaviour, timeout=timeout):
        path.append(sample.pose)
        if each is not None:
            each(sample)
    poses = np.array([(pose.x, pose.y, pose.heading) for pose in path])
    return BehaviourEnd(sample.step.outcome, sample.step.why, sample.time - began, poses)
