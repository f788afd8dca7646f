"""Points of the plane from one frame into another: x is ahead of a pose, y to its left."""

import math

import numpy as np
from numpy.typing import NDArray

from robots.motion import Pose


def into(pose: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) in the frame of who is at ``pose``."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return (points - (pose.x, pose.y)) @ np.array([[cos, -sin], [sin, cos]])


def out_of(pose: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) of the frame of who is at ``pose``, in the frame that the pose is in."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return points @ np.array([[cos, sin], [-sin, cos]]) + (pose.x, pose.y)
