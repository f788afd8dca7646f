"""Points of the robot and of the world, as Rerun's plane shows them: its y runs downwards."""

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.view import View

Points = NDArray[np.float64]

ROBOT: Points = np.array([(-0.35, -0.3), (0.3, -0.3), (0.5, 0.0), (0.3, 0.3), (-0.35, 0.3), (-0.35, -0.3)])
"""Outline of a robot that looks along x, (6, 2) [m]: a mark, not a model."""

ORIGIN = Pose(0.0, 0.0, 0.0)


def north_up(points: Points) -> Points:
    """World points (n, 2) [m], drawn with north up."""
    return np.multiply(points, (1.0, -1.0))


def robot_up(points: Points) -> Points:
    """Points in the robot's frame (n, 2) [m], x forward and y left, drawn with forward up."""
    return np.negative(points[:, ::-1])


def circle(radius: float, centre: Pose = ORIGIN) -> Points:
    """A circle, (49, 2) [m]."""
    angles = np.linspace(0, 2 * np.pi, 49)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) + (centre.x, centre.y)


def returns(view: View) -> Points:
    """End points of the beams that came back, in the scanner's frame, (n, 2) [m]."""
    if view.scan is None:
        return np.empty((0, 2))
    return view.scan.points[view.scan.returned]
