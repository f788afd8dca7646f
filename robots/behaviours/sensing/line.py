"""Directed lines in the plane."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.planar import PlanarPose, into, out_of, wrapped


@dataclass(frozen=True, slots=True)
class DirectedLine(PlanarPose):
    """A line through (``x``, ``y``) [m] along ``heading`` [rad]; what is across of it counts to the left."""

    @classmethod
    def through(cls, pose: PlanarPose) -> "DirectedLine":
        """The line that a robot at ``pose`` looks along."""
        return cls(pose.x, pose.y, pose.heading)

    def seen(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 2) as (along, across) [m]."""
        return into(self, points)

    def points(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 2) that are given as (along, across) [m]."""
        return out_of(self, seen)

    def pose(self, pose: PlanarPose) -> PlanarPose:
        """A pose as along, across and heading against the line, within ±π."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        x, y = pose.x - self.x, pose.y - self.y
        angle = wrapped(pose.heading - self.heading)
        return PlanarPose(cos * x + sin * y, cos * y - sin * x, angle)

    def at(self, along: float, across: float, turned: float = 0.0) -> "DirectedLine":
        """The line through a point given as (along, across) of this one, turned by an angle [rad] against it."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return DirectedLine(
            self.x + cos * along - sin * across, self.y + sin * along + cos * across, self.heading + turned
        )
