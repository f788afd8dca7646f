"""The common base of behaviours: they heed the robot's stops, wait a while, end once, and never drive too fast."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from refseq_bench.robots.behaviours.behaviour import (
    BehaviourOutcome,
    BehaviourStep,
    RobotDescription,
    Senses,
    failed,
    waiting,
)
from refseq_bench.robots.motion import Twist
from refseq_bench.robots.state import LATCHED, Blocked, RobotState, Stop

PATIENCE = 10.0
"""Time that a behaviour waits for what may go away by itself, such as a person [s]: a choice."""
GOT_ON, TURNED_ON = 0.3, math.radians(20)
"""After a wait a robot has got on when it has moved or turned by more [m, rad]: a choice."""
STALE = 0.5
"""A state older than this is none [s]: a choice, five times the period of the slowest robot's reports."""


class Guarded(ABC):
    """A behaviour that is written as ``_move`` only; this class does the rest.

    ``_move`` may say what it waits for (``waiting``). That, or a stop that keeps it from going, may last ``patience``
    [s]; then the behaviour has failed. Time runs until it has got on a little, so that one that starts and stops before
    the same thing fails too. A latched stop fails it at once.
    """

    def __init__(self, robot: RobotDescription, patience: float = PATIENCE) -> None:
        self.robot, self.patience = robot, patience
        self._end: BehaviourStep | None = None
        self._waits: _Wait | None = None

    def step(self, senses: Senses) -> BehaviourStep:
        """Say how to move now; after the end it says stop, with the same outcome."""
        if self._end is not None:
            return self._end
        step = self._patient(self._heeding(senses), senses)
        if step.outcome is not BehaviourOutcome.RUNNING:
            step = self._end = BehaviourStep(outcome=step.outcome, why=step.why)
        return step

    @abstractmethod
    def _move(self, senses: Senses) -> BehaviourStep:
        """Say how to move now; the state is a good one and holds no latched stop."""

    def _heeding(self, senses: Senses) -> BehaviourStep:
        state = senses.state
        if not _finite(state):
            return waiting("the odometer reads no number")
        if latched := next((stop for stop in state.stops if stop.cause in LATCHED), None):
            return failed(str(latched))
        if not senses.age < STALE:
            return waiting(f"no news of the robot for {senses.age:.1f} s")
        wanted = self._move(senses)
        if wanted.outcome is not BehaviourOutcome.RUNNING:
            return wanted
        twist = self.robot.limits.limited(wanted.twist)
        if stop := next((stop for stop in state.stops if _forbids(stop, twist)), None):
            return waiting(str(stop))
        return BehaviourStep(twist, why=wanted.why)

    def _patient(self, step: BehaviourStep, senses: Senses) -> BehaviourStep:
        if self._waits is not None:
            self._waits = self._waits.at(senses.state)
        if step.outcome is not BehaviourOutcome.RUNNING or not step.why:
            return step
        if self._waits is None:
            self._waits = _Wait(senses.now, senses.state)
        if senses.now - self._waits.since >= self.patience:
            return self._given_up(f"waited {self.patience:g} s: {step.why}")
        return step

    def _given_up(self, why: str) -> BehaviourStep:
        """Say what becomes of it when its patience is at an end."""
        return failed(why)


@dataclass(frozen=True, slots=True)
class _Wait:
    """A wait ``since`` a time [s], which began in a state."""

    since: float
    began: RobotState

    def at(self, state: RobotState) -> "_Wait | None":
        """Return the wait at a later state, None once the robot has got on.

        One that began where the odometer read no number counts from the first place that is one.
        """
        if not _finite(state):
            return self
        if not _finite(self.began):
            return _Wait(self.since, state)
        moved, turned = state.distance - self.began.distance, state.pose.heading - self.began.pose.heading
        return None if abs(moved) > GOT_ON or abs(turned) > TURNED_ON else self


def _forbids(stop: Stop, twist: Twist) -> bool:
    """True if a stop keeps the robot from a motion. Waiting is a command too: it ends a stop for want of one."""
    if stop.blocks is Blocked.ALL:
        return twist != Twist()
    return twist.linear > 0 if stop.blocks is Blocked.FORWARD else twist.linear < 0


def _finite(state: RobotState) -> bool:
    pose, twist = state.pose, state.twist
    return all(
        map(math.isfinite, (state.time, pose.x, pose.y, pose.heading, state.distance, twist.linear, twist.angular))
    )
