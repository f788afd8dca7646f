"""State of a robot for those above, in SI units: where it thinks it is, and why it does not go on."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose


class Cause(Enum):
    """Why a robot does not go as it is told."""

    EMERGENCY = "emergency stop"
    NO_COMMAND = "no command"
    NO_ANSWER = "no answer"
    BUMPER = "bumper"
    SONAR = "sonar"
    LASER = "laser"
    TIPPED = "tipped over"
    STUCK = "stuck wheel"
    SENSOR = "sensor fault"


STANDS = 0.02
"""A robot that is slower stands [m/s, rad/s]: a choice, a balancing one is never quite still."""
LATCHED = frozenset({Cause.EMERGENCY, Cause.TIPPED, Cause.STUCK, Cause.SENSOR})
"""Causes that hold until somebody releases the robot; the others go when their reason goes."""


class Blocked(Enum):
    """Motion that a stop forbids."""

    ALL = "all"
    FORWARD = "forward"
    BACKWARD = "backward"


@dataclass(frozen=True, slots=True)
class Stop:
    """One reason not to go: its cause, what was read (one line, with values), since when [s], what it forbids."""

    cause: Cause
    detail: str
    since: float
    blocks: Blocked = Blocked.ALL

    def __str__(self) -> str:
        """The cause, and what was read where that is told."""
        return f"{self.cause.value}: {self.detail}" if self.detail else self.cause.value


class Motors(Enum):
    """State of the motors."""

    ON = "on"
    LOCKED = "locked"
    OFF = "off"


@dataclass(frozen=True, slots=True)
class RobotState:
    """State that the Control layer last heard from the robot, at ``time`` [s].

    ``pose`` is the odometer's since the start, ``distance`` [m] the signed path length, ``twist`` the motion that was
    measured. ``stops`` are all reasons not to go that hold now, in the order in which they came; empty when it is free.
    ``pitch`` [rad], nose down is positive. ``sonar`` (n,) [m] where there is one. ``mode`` is the robot's own word.
    """

    time: float = 0.0
    pose: PlanarPose = field(default_factory=PlanarPose)
    distance: float = 0.0
    twist: Twist = field(default_factory=Twist)
    stops: tuple[Stop, ...] = ()
    motors: Motors = Motors.ON
    mode: str = ""
    pitch: float = 0.0
    sonar: NDArray[np.float64] | None = None

    @property
    def free(self) -> bool:
        """True if nothing keeps it from going as it is told."""
        return not self.stops

    @property
    def stands(self) -> bool:
        """True if it neither goes nor turns, by its own measure: each is slower than ``STANDS``."""
        return abs(self.twist.linear) < STANDS and abs(self.twist.angular) < STANDS
