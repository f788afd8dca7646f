"""Directed lines in the plane, and how a robot is steered along one."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.motion import Limits, Pose

APPROACH = math.radians(30)
"""The steepest that a robot heads for its line: a choice."""
CONVERGENCE = 1.0
"""How strongly it heads for it [rad/m]: with ``TURN_GAIN`` a damping ratio of 1 at 0.5 m/s; a choice."""
TURN_GAIN = 2.0
"""Turn rate for an error of heading [rad/s per rad]: a choice."""
EASE = 0.5
"""Share of the robot's accelerations that behaviours brake with, so that it can follow: a choice."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line through (``x``, ``y``) [m] along ``heading`` [rad]; what is across of it counts to the left."""

    x: float
    y: float
    heading: float

    @classmethod
    def through(cls, pose: Pose) -> "Line":
        """The line that a robot at ``pose`` looks along."""
        return cls(pose.x, pose.y, pose.heading)

    def seen(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 2) as (along, across) [m]."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return (points - (self.x, self.y)) @ np.array([[cos, -sin], [sin, cos]])

    def pose(self, pose: Pose) -> Pose:
        """A pose as along, across and heading against the line, within ±π."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        x, y = pose.x - self.x, pose.y - self.y
        angle = math.remainder(pose.heading - self.heading, 2 * math.pi)
        return Pose(cos * x + sin * y, cos * y - sin * x, angle)

    def at(self, along: float, across: float, turned: float = 0.0) -> "Line":
        """The line through a point given as (along, across) of this one, turned by an angle [rad] against it."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return Line(self.x + cos * along - sin * across, self.y + sin * along + cos * across, self.heading + turned)


def turn_rate_onto(error: Pose, offset: float = 0.0) -> float:
    """Turn rate [rad/s] of a robot that is off its line by ``error`` and wants to be ``offset`` [m] to the left of it.

    It heads for the line at an angle that grows with the distance, up to ``APPROACH``.
    """
    wanted = min(max(CONVERGENCE * (offset - error.y), -APPROACH), APPROACH)
    return TURN_GAIN * math.remainder(wanted - error.heading, 2 * math.pi)


def speed_to_stop(distance: float, acceleration: float, reaction: float = 0.0) -> float:
    """The greatest speed [m/s, rad/s] from which the robot stops in ``distance`` [m, rad] at its ease.

    It brakes after a ``reaction`` time [s]: v·t + v²/2a = d.
    """
    way = EASE * acceleration * reaction
    return math.sqrt(way**2 + 2 * EASE * acceleration * max(distance, 0.0)) - way


def speed_for(limits: Limits, cruise: float, distance: float) -> float:
    """Speed [m/s] on a way that ends in ``distance`` [m]; close to its end it falls with the distance."""
    return min(cruise, limits.speed, speed_to_stop(distance, limits.acceleration), TURN_GAIN * max(distance, 0.0))
