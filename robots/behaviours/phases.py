"""Parts that behaviours are made of: a turn on the spot, and a straight way. Each says None once it is done."""

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from robots.behaviours.behaviour import Frame, Ranger, Senses, Step, waiting
from robots.behaviours.line import Line, speed_for, speed_to_stop, turn_rate_onto
from robots.behaviours.room import LOOK, MARGIN, blocks_turn, free_ahead
from robots.behaviours.surroundings import Surroundings
from robots.motion import Limits, Twist

CRUISE = 0.5
"""Speed of behaviours where the robot is let [m/s]: what people drive the Robuter with; for others a choice."""
ARRIVED = 0.01
"""A way is driven when no more than this is left of it [m]: a choice."""
TURNED = math.radians(0.3)
"""A turn is done when no more than this is left of it: a choice."""
SETTLED = 0.5
"""For so long it has to stay there without a command to turn [s]: a choice, as long as a balancing robot lags."""
CREEP, CRAWL = 0.03, 0.03
"""The slowest that it still goes [m/s] and turns [rad/s], so that it arrives: a choice."""
SONAR_HISTORY = 3
"""Readings of a sonar of which the middle one counts, as single ones err: a choice."""
SONAR_REACH = 2.0
"""A sonar's echo from farther away is not looked at [m]: a choice."""


TIGHT = 3.0
"""Arcs that are tighter are looked at as this one [1/m]: a choice."""
STOP_SHORT = 0.02
"""With no more way free than this a robot does not set out [m]: a choice."""
REACTION = 0.5
"""How long before it brakes a robot may have to see what stands there [s]: a scan's and a state's age, and the round of
the Robuter's sonars, which else would stop it first."""
EASED = (1.0, 0.5, 0.25, 0.1, 0.0)
"""Parts of the curvature that it tries: a choice."""
ENOUGH = 0.3
"""With so much way free it takes an arc [m]: a choice."""
SIDESTEP = 0.1
"""A robot whose way is blocked turns on the spot if it wants to turn faster than this [rad/s]: a choice."""

Points = NDArray[np.float64]
"""Points (n, 2) [m] in the robot's frame."""


class Phase(Protocol):
    """A part of a behaviour."""

    def step(self, senses: Senses, around: Surroundings) -> Step | None:
        """Say how to move now, None when there is nothing left to do."""


class Turning:
    """Turn on the spot until the odometer shows ``target`` [rad], which is not wrapped.

    Room is what the laser sees ahead, what it remembers of what it has passed, and what the sonars hear; glass, what is
    lower or higher than the laser's plane, and what is behind a robot that has not moved yet and has no sonars, nobody
    sees.
    """

    def __init__(self, frame: Frame, target: float) -> None:
        self._frame, self._target = frame, target
        self._echoes = Echoes(frame.sonars)
        self._there_since: float | None = None

    def step(self, senses: Senses, around: Surroundings) -> Step | None:
        """Say how to turn now."""
        pose = senses.pose
        left = self._target - pose.heading
        if abs(left) < TURNED:
            return self._settling(senses.now)
        self._there_since = None
        if around.lost:
            return waiting(around.lost)
        points = np.concatenate([around.points(pose), self._echoes.points(senses)])
        return turned(self._frame, points, left)

    def _settling(self, now: float) -> Step | None:
        """Stand still, until it is sure that the turn stays where it is."""
        if self._there_since is None:
            self._there_since = now
        return None if now - self._there_since >= SETTLED else Step()


class Straight:
    """Follow a line from its point on for ``length`` [m]; what stands on it is waited for."""

    def __init__(self, frame: Frame, line: Line, length: float) -> None:
        self._frame, self._line, self._length = frame, line, length

    def step(self, senses: Senses, around: Surroundings) -> Step | None:
        """Say how to drive now."""
        error = self._line.pose(senses.pose)
        left = self._length - error.x
        if left < ARRIVED:
            return None
        if around.lost:
            return waiting(around.lost)
        return driven(self._frame, around.points(senses.pose), turn_rate_onto(error), left)


class Travelled:
    """Path length since the first look [m]."""

    def __init__(self) -> None:
        self._start: float | None = None

    def so_far(self, senses: Senses) -> float:
        """The length up to now."""
        if self._start is None:
            self._start = senses.distance
        return senses.distance - self._start


def driven(frame: Frame, points: Points, turn_rate: float, left: float) -> Step:
    """Drive on with a turn rate [rad/s], as fast as the way that is ``left`` [m] and the ``points`` ahead let it.

    A robot that cannot turn so fast drives slower.
    """
    limits = frame.limits
    wanted = limits.limited(Twist(max(speed_for(limits, CRUISE, left), CREEP), turn_rate))
    return _clear(frame, points, wanted)


def turned(frame: Frame, points: Points, left: float) -> Step:
    """Turn on the spot with ``left`` [rad] to go, where the ``points`` let it."""
    near = blocks_turn(points, frame.shape, left)
    if len(near):
        return waiting(f"no room to turn by {math.degrees(left):.0f}°: {_place(near[0])}")
    return Step(Twist(0.0, math.copysign(turn_speed(frame.limits, abs(left)), left)))


def _clear(frame: Frame, points: Points, wanted: Twist) -> Step:
    """The wanted motion, on a wider arc where its tail would swing into something, slower where something is ahead."""
    for part in EASED:
        eased = Twist(wanted.linear, part * wanted.angular)
        free = free_ahead(points, frame.shape, _curvature(eased), LOOK)
        if free > ENOUGH:
            break
    if free > STOP_SHORT:
        speed = min(eased.linear, speed_to_stop(free, frame.limits.acceleration, REACTION))
        return Step(Twist(speed, eased.angular * speed / eased.linear))
    if abs(wanted.angular) > SIDESTEP and not len(blocks_turn(points, frame.shape, wanted.angular)):
        return Step(Twist(0.0, wanted.angular))
    return waiting(f"way blocked {free + MARGIN:.2f} m ahead")


def turn_speed(limits: Limits, left: float) -> float:
    """Turn rate [rad/s] with ``left`` [rad] to go."""
    return max(min(limits.turn_rate, speed_to_stop(left, limits.angular_acceleration), 2.0 * left), CRAWL)


class Echoes:
    """What the sonars have heard near the robot, as points in the middle of their cones."""

    def __init__(self, sonars: tuple[Ranger, ...]) -> None:
        self._sonars = np.array(sonars, np.float64).reshape(-1, 3)
        self._readings: list[NDArray[np.float64]] = []

    def points(self, senses: Senses) -> Points:
        """Points (n, 2) [m] in the robot's frame."""
        heard = senses.state.sonar
        if heard is None or len(heard) != len(self._sonars):
            return np.empty((0, 2))
        if not self._readings or heard is not self._readings[-1]:
            self._readings = [*self._readings[1 - SONAR_HISTORY :], np.nan_to_num(heard, nan=np.inf)]
        middle = np.median(self._readings, axis=0)
        near = (middle >= 0) & (middle < SONAR_REACH)
        x, y, bearing = self._sonars[near].T
        return np.stack([x + middle[near] * np.cos(bearing), y + middle[near] * np.sin(bearing)], axis=1)


def _curvature(twist: Twist) -> float:
    """Curvature of an arc [1/m]; what is as good as a turn on the spot counts as a tight arc."""
    return min(max(twist.angular / max(twist.linear, CREEP), -TIGHT), TIGHT)


def _place(point: Points) -> str:
    x, y = point
    return f"something {math.hypot(x, y):.2f} m away at {math.degrees(math.atan2(y, x)):.0f}°"
