"""Geometry in the plane: poses, angles, motions between poses, points in the frame of a pose."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose in the plane: ``x``, ``y`` [m] and ``heading`` [rad], counter-clockwise from the x axis."""

    x: float
    y: float
    heading: float


def wrap(angle: float) -> float:
    """The same direction as ``angle``, in (−π, π] [rad]; ``math.remainder`` rounds otherwise and leaves −π."""
    return math.pi - (math.pi - angle) % (2 * math.pi)


def wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same directions, of any shape, in [−π, π) [rad]."""
    return np.remainder(angles + math.pi, 2 * math.pi) - math.pi


def motion_between(before: Pose, after: Pose) -> tuple[float, float]:
    """Distance [m] and turn [rad] from one pose to the next; the distance is negative when the robot reversed.

    The distance is the chord: between two views of a path the arc is longer by turn²/24, 0.4 % at 18°.
    """
    east, north = after.x - before.x, after.y - before.y
    turn = wrap(after.heading - before.heading)
    heading = before.heading + turn / 2
    forward = east * math.cos(heading) + north * math.sin(heading)
    return math.copysign(math.hypot(east, north), forward), turn


def after_motion(pose: Pose, distance: float, turn: float) -> Pose:
    """Where a motion leads from ``pose``, along the chord of an arc: on arcs the inverse of ``motion_between``."""
    along = pose.heading + turn / 2
    return Pose(pose.x + distance * math.cos(along), pose.y + distance * math.sin(along), pose.heading + turn)


def relative_pose(pose: Pose, origin: Pose) -> Pose:
    """``pose`` in the frame of ``origin``; the heading is not wrapped."""
    dx, dy = pose.x - origin.x, pose.y - origin.y
    cos, sin = math.cos(origin.heading), math.sin(origin.heading)
    return Pose(cos * dx + sin * dy, cos * dy - sin * dx, pose.heading - origin.heading)


def in_world(points: ArrayLike, pose: Pose) -> NDArray[np.float64]:
    """Points in the frame of a pose, (…, 2) [m], in the frame that the pose is in."""
    x, y = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return np.stack([pose.x + cos * x - sin * y, pose.y + sin * x + cos * y], axis=-1)
