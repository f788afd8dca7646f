"""Straight legs of a path: the odometry's poses as a polyline (Douglas and Peucker 1973)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, wrap

TOLERANCE = 0.2
"""A leg leaves the path by no more than this [m]: a choice, as much as a careful person wanders to the side. Less would
break a straight corridor into many legs, more cuts corners."""
BEND = math.radians(15)
"""Two poses that differ in heading by more have a corner between them: a choice, above what wandering turns."""
SHARPEST = math.radians(150)
"""A greater turn has no corner that the poses before and behind it could tell: the robot turned back."""
CORNER = 1.6
"""Vertices of one sense that are nearer together than this are one corner [m]: a choice, for the arc on which a robot
turns without a stop."""
CLEAR = 0.8
"""A view so far from a corner is on a leg, and no longer on the arc [m]: a choice, about a robot's length."""
LOCAL = 8.0
"""So much of a leg tells its direction at either end [m]: a choice. In a longer part the odometer's drift shows, in a
shorter one the wandering to the side."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A straight part of a path, from ``start`` to ``end`` [m along it].

    It begins and ends in corners. Where the path cuts one, or has no view there, it is shorter than the legs: the next
    leg starts before this one ends, and what lies between is gone twice.

    ``begins`` and ``ends`` are its headings there [rad, in the odometer's frame, not wrapped]: drift may bend it.
    """

    start: float
    end: float
    begins: float
    ends: float


def legs_of(poses: Sequence[Pose], along: NDArray[np.float64]) -> list[Leg]:
    """The legs of a path: ``poses`` (K,) by odometry, their headings not wrapped, ``along`` (K,) of it [m]."""
    way = _with_corners(poses, along)  # (n, 3): x, y, along
    vertices = _joined(way[_kept(way[:, :2])])
    ends = [(one, other) for one, other in pairwise(vertices) if other[2] > one[2]]
    legs: list[Leg] = []
    for one, other in ends:
        start = along[0] if one is vertices[0] else _measured(one, poses, along, -1)
        end = along[-1] if other is vertices[-1] else _measured(other, poses, along, 1)
        part = np.concatenate([[one], way[(way[:, 2] > one[2]) & (way[:, 2] < other[2])], [other]])
        # Where views are farther apart than that, a corner and the next view tell the direction.
        early = max(2, int((part[:, 2] <= one[2] + LOCAL).sum()))
        late = max(2, int((part[:, 2] >= other[2] - LOCAL).sum()))
        headings = (_heading(part[:early]), _heading(part[-late:]))
        near = float(np.interp((one[2] + other[2]) / 2, along, [pose.heading for pose in poses]))
        begins, finish = (near + wrap(heading - near) for heading in headings)
        legs.append(Leg(float(start), float(end), begins, finish))
    return legs


def _measured(corner: NDArray[np.float64], poses: Sequence[Pose], along: NDArray[np.float64], side: int) -> float:
    """Where a corner is on the leg before it (``side`` 1) or behind it (-1) [m along]: by a view clear of its arc."""
    views = range(len(poses))[::-side]
    beside = [k for k in views if side * (corner[2] - along[k]) >= 0]
    view = next((k for k in beside if abs(corner[2] - along[k]) >= CLEAR), beside[0])
    return float(along[view]) + side * math.dist(corner[:2], (poses[view].x, poses[view].y))


def _with_corners(poses: Sequence[Pose], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """All places, and the corners between them: x, y and along [m], (n, 3)."""
    points = [(poses[0].x, poses[0].y, float(along[0]))]
    for (before, after), (first, last) in zip(pairwise(poses), pairwise(along.tolist()), strict=True):
        if BEND < abs(after.heading - before.heading) < SHARPEST:
            corner = _crossing(before, after)
            if corner is not None and 0 < corner[2] < 1:
                points.append((corner[0], corner[1], first + corner[2] * (last - first)))
        points.append((after.x, after.y, last))
    return np.array(points)


def _crossing(before: Pose, after: Pose) -> tuple[float, float, float] | None:
    """The point ahead of one pose and behind the other, and which share of the way between them it lies at."""
    cross = math.sin(after.heading - before.heading)
    if abs(cross) < math.sin(BEND):
        return None
    x, y = after.x - before.x, after.y - before.y
    ahead = (x * math.sin(after.heading) - y * math.cos(after.heading)) / cross
    behind = (x * math.sin(before.heading) - y * math.cos(before.heading)) / cross
    if ahead <= 0 or behind >= 0 or max(ahead, -behind) > 2 * math.hypot(x, y):
        return None
    corner = before.x + ahead * math.cos(before.heading), before.y + ahead * math.sin(before.heading)
    return *corner, ahead / (ahead - behind)


def _kept(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask of the points (n, 2) that stay in the polyline."""
    kept = np.zeros(len(points), np.bool_)
    kept[[0, -1]] = True
    open_ = [(0, len(points) - 1)]
    while open_:
        first, last = open_.pop()
        away = _distances(points[first + 1 : last], points[first], points[last])
        if len(away) and away.max() > TOLERANCE:
            middle = first + 1 + int(away.argmax())
            kept[middle] = True
            open_ += [(first, middle), (middle, last)]
    return kept


def _distances(
    points: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distances of points (n, 2) from the segment between two others [m]: one that turns back leaves its line, too."""
    along = end - start
    share = np.clip((points - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.hypot(*(points - start - share[:, None] * along).T), np.float64)


def _joined(vertices: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The vertices (n, 3), those of a turn on an arc in one."""
    joined = list(vertices)
    number = 1
    while number + 2 < len(joined):
        corner = _corner(*joined[number - 1 : number + 3])
        if corner is None:
            number += 1
        else:
            joined[number : number + 2] = [corner]
    return joined


def _corner(
    before: NDArray[np.float64], one: NDArray[np.float64], other: NDArray[np.float64], after: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """The corner in place of the middle two of four vertices; None where they are two."""
    if math.dist(one[:2], other[:2]) > CORNER:
        return None
    into, out = (math.atan2(*(b - a)[1::-1]) for a, b in ((before, one), (other, after)))
    found = _crossing(Pose(float(one[0]), float(one[1]), into), Pose(float(other[0]), float(other[1]), out))
    if found is None:
        return None
    return np.array([found[0], found[1], one[2] + found[2] * (other[2] - one[2])])


def _heading(part: NDArray[np.float64]) -> float:
    """Direction of the line with the least squares through points (n, 3) in their order [rad]."""
    points = part[:, :2] - part[:, :2].mean(axis=0)
    x, y = points.T
    angle = 0.5 * math.atan2(2 * float(x @ y), float(x @ x - y @ y))
    east, north = points[-1] - points[0]
    return angle if east * math.cos(angle) + north * math.sin(angle) >= 0 else angle + math.pi
