"""The interface of behaviours: from what a robot senses to how it is to go on, until it is done (card X1, appendix C).

A behaviour knows no map and no truth. One object is one execution: make another to do the same again.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple, Protocol

from refseq_bench.robots.motion import Limits, Twist
from refseq_bench.robots.mounting import Mounting
from refseq_bench.robots.odometry import along_arc
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.robot import Shape
from refseq_bench.robots.signals import LaserScan
from refseq_bench.robots.state import RobotState

LONGEST_FORECAST = 0.3
"""A state is carried on by its own velocity for no longer than this [s]: a choice."""


@dataclass(frozen=True, slots=True)
class Senses:
    """Readings of the robot at ``time`` [s]: its own ``state`` (odometry, sonars, stops) and the newest ``scan``.

    There is no scan where the laser is lost. Without a time the state counts as new.
    """

    state: RobotState
    scan: LaserScan | None
    time: float | None = None

    @property
    def now(self) -> float:
        """The time [s]."""
        return self.state.time if self.time is None else self.time

    @property
    def age(self) -> float:
        """Age of the state [s]."""
        return self.now - self.state.time

    @property
    def pose(self) -> PlanarPose:
        """Where the odometer would be now: the state's pose carried on by the state's velocity, as that may be old."""
        twist, elapsed = self.state.twist, self._forecast
        return along_arc(self.state.pose, twist.linear * elapsed, twist.angular * elapsed)

    @property
    def distance(self) -> float:
        """Path length now [m]: carried on like the pose."""
        return self.state.distance + self.state.twist.linear * self._forecast

    @property
    def _forecast(self) -> float:
        return min(max(self.age, 0.0), LONGEST_FORECAST)


class Ranger(NamedTuple):
    """Where a sonar is on the robot [m] and which way it looks [rad]."""

    x: float
    y: float
    bearing: float


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """The robot that a behaviour moves: the room it takes, how fast it is let, where its sensors are.

    Where nothing is in the way a behaviour is as fast as the ``limits`` let it: who wants it slower gives lower ones.
    ``sonars`` are in the order of readings.
    """

    shape: Shape
    limits: Limits
    laser: Mounting
    sonars: tuple[Ranger, ...] = ()


class BehaviourOutcome(Enum):
    """Progress of a behaviour."""

    RUNNING = "running"
    FINISHED = "finished"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class BehaviourStep:
    """One period's answer of a behaviour: a motion, and whether it goes on.

    ``why`` is one line with values: the reason of the end, or while it runs, what it waits for; else empty.
    """

    twist: Twist = field(default_factory=Twist)
    outcome: BehaviourOutcome = BehaviourOutcome.RUNNING
    why: str = ""


def finished(why: str) -> BehaviourStep:
    """The end of a behaviour that has done what it was to do."""
    return BehaviourStep(outcome=BehaviourOutcome.FINISHED, why=why)


def failed(why: str) -> BehaviourStep:
    """The end of a behaviour that cannot do it."""
    return BehaviourStep(outcome=BehaviourOutcome.FAILED, why=why)


def waiting(why: str, angular: float = 0.0) -> BehaviourStep:
    """Stay where it is, for a reason that may go away."""
    return BehaviourStep(Twist(0.0, angular), why=why)


class Behaviour(Protocol):
    """One way to move, until it has finished or failed."""

    def step(self, senses: Senses) -> BehaviourStep:
        """Say how to move now; after the end it says stop, with the same outcome."""
