"""Parts that behaviours are made of: a turn on the spot, and a straight way. Each says None once it is done."""

import math
from typing import Protocol

import numpy as np

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, waiting
from refseq_bench.robots.behaviours.moves import CREEP, driven, fits_arc, turned
from refseq_bench.robots.behaviours.sensing.lanes import lane_past
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.sonar_ring import SonarEchoes
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.behaviours.steering import TURN_GAIN, speed_for, turn_rate_onto

ARRIVED = 0.01
"""A way is driven when no more than this is left of it [m]: a choice."""
TURNED = math.radians(0.3)
"""A turn is done when no more than this is left of it: a choice."""
SETTLED = 0.5
"""For so long it has to stay there without a command to turn [s]: a choice, as long as a balancing robot lags."""


class Phase(Protocol):
    """A part of a behaviour."""

    def step(self, senses: Senses, around: Surroundings) -> BehaviourStep | None:
        """Say how to move now, None when there is nothing left to do."""


class Settled:
    """Clock of a turn on the spot: it is done once the robot has stayed there for a while."""

    def __init__(self) -> None:
        self._since: float | None = None

    def look(self, left: float, now: float) -> bool:
        """True if what is ``left`` of the turn [rad] has been less than ``TURNED`` for ``SETTLED`` [s] at ``now``."""
        if not abs(left) < TURNED:
            self._since = None
            return False
        self._since = now if self._since is None else self._since
        return now - self._since >= SETTLED


class Turning:
    """Turn on the spot until the odometer shows ``target`` [rad], which is not wrapped.

    Room is what the laser sees ahead, what it remembers of what it has passed, and what the sonars hear; glass, what is
    lower or higher than the laser's plane, and what is behind a robot that has not moved yet and has no sonars, nobody
    sees.
    """

    def __init__(self, robot: RobotDescription, target: float) -> None:
        self._robot, self._target = robot, target
        self._echoes, self._settled = SonarEchoes(robot.sonars), Settled()

    def step(self, senses: Senses, around: Surroundings) -> BehaviourStep | None:
        """Say how to turn now."""
        pose = senses.pose
        left = self._target - pose.heading
        if self._settled.look(left, senses.now):
            return None
        if abs(left) < TURNED:
            return BehaviourStep()
        if around.lost:
            return waiting(around.lost)
        points = np.concatenate([around.points(pose), self._echoes.points(senses)])
        return turned(self._robot, points, left)


class Arc:
    """Drive on an arc of ``radius`` [m] until the odometer shows the heading ``target`` [rad], which is not wrapped.

    The heading follows the way that is gone, as a robot that balances turns before it gets going. Where something
    stands on the arc it turns the rest on the spot, or drives a wider arc where there is no room for that.
    """

    def __init__(self, robot: RobotDescription, target: float, radius: float) -> None:
        self._robot, self._target, self._radius = robot, target, radius
        self._travelled = Travelled()
        self._angle: float | None = None
        self._rest: Turning | None = None

    def step(self, senses: Senses, around: Surroundings) -> BehaviourStep | None:
        """Say how to drive now."""
        if self._rest is not None:
            return self._rest.step(senses, around)
        pose, gone = senses.pose, self._travelled.so_far(senses)
        left = self._target - pose.heading
        self._angle = self._angle or left
        sense = math.copysign(1.0, self._angle)
        if left * sense < TURNED:
            return None
        if around.lost:
            return waiting(around.lost)
        points = around.points(pose)
        if not fits_arc(self._robot, points, sense / self._radius) and not turned(self._robot, points, left).why:
            # On a wider arc it would use up the room that it has, and meet the same thing a little farther on.
            self._rest = Turning(self._robot, self._target)
            return self._rest.step(senses, around)
        behind = min(gone / self._radius, abs(self._angle)) - (abs(self._angle) - left * sense)
        limits, way = self._robot.limits, self._radius * abs(left)
        fastest = max(speed_for(limits, limits.speed, way), CREEP) / self._radius
        rate = max(senses.state.twist.linear, CREEP) / self._radius + TURN_GAIN * behind
        return driven(self._robot, points, sense * min(max(rate, 0.0), fastest), way)


class Straight:
    """Follow a line from its point on for ``length`` [m], past what stands on it, and back onto it.

    Where there is no room to pass it waits.
    """

    def __init__(self, robot: RobotDescription, line: DirectedLine, length: float) -> None:
        self._robot, self._line, self._length = robot, line, length

    def step(self, senses: Senses, around: Surroundings) -> BehaviourStep | None:
        """Say how to drive now."""
        error = self._line.pose(senses.pose)
        left = self._length - error.x
        if left < ARRIVED:
            return None
        if around.lost:
            return waiting(around.lost)
        offset = lane_past(self._line.seen(around.all), error.x, self._robot.shape, left)
        return driven(self._robot, around.points(senses.pose), turn_rate_onto(error, offset), left)


class Travelled:
    """Path length since the first look [m]."""

    def __init__(self) -> None:
        self._start: float | None = None

    def so_far(self, senses: Senses) -> float:
        """The length up to now."""
        if self._start is None:
            self._start = senses.distance
        return senses.distance - self._start
