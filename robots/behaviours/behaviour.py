"""What a behaviour is: it looks at what the robot senses, says how to go on, and when it is done (card X1, appendix C).

A behaviour knows no map and no truth. One object is one execution: make another to do the same again.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from robots.motion import Limits, Twist
from robots.robot import Shape
from robots.signals import LaserScan
from robots.state import RobotState


@dataclass(frozen=True, slots=True)
class Senses:
    """What the robot senses now: its own ``state`` (odometry, sonars, stops) and the newest ``scan``."""

    state: RobotState
    scan: LaserScan


@dataclass(frozen=True, slots=True)
class Frame:
    """The robot that a behaviour moves: the room it takes and how fast it is let."""

    shape: Shape
    limits: Limits


class Outcome(Enum):
    """How far a behaviour has come."""

    RUNNING = "running"
    FINISHED = "finished"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Step:
    """What a behaviour wants: a motion, and whether it goes on; ``why`` is one line, with values, once it ended."""

    twist: Twist = field(default_factory=Twist)
    outcome: Outcome = Outcome.RUNNING
    why: str = ""


class Behaviour(Protocol):
    """One way to move, until it has finished or failed."""

    def step(self, senses: Senses) -> Step:
        """Say how to move now; after the end it says stop, with the same outcome."""
