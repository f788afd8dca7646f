"""Geometry in the plane: poses, angles, points from one frame into another. x is ahead of a pose, y to its left."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """A pose in the plane: ``x``, ``y`` [m] and ``heading`` [rad], counter-clockwise from the x axis, not wrapped."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0


def wrapped(angle: float) -> float:
    """The same direction as ``angle``, in [−π, π] [rad]."""
    return math.remainder(angle, 2 * math.pi)


def into(pose: PlanarPose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) [m] in the frame of ``pose``."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return (points - (pose.x, pose.y)) @ np.array([[cos, -sin], [sin, cos]])


def out_of(pose: PlanarPose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) [m] given in the frame of ``pose``, in the frame that the pose is in."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return points @ np.array([[cos, sin], [-sin, cos]]) + (pose.x, pose.y)
