"""Routes as polylines in the plane: checked once for all who drive along them, and where along them a robot is."""

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq.planar import Pose
from refseq_bench.sim.errors import SimError

REACH = 2.0
"""Distance along a polyline within which a robot is looked for again [m]: a choice, twice the way of a second."""


def polyline(route: ArrayLike) -> NDArray[np.float64]:
    """Return a private copy of ``route`` (n, 2) [m] without repeated points. Raises ``SimError`` for what is none."""
    points = np.array(route, float)
    if points.ndim != 2 or points.shape[1:] != (2,):
        raise SimError(f"a route has shape (n, 2), not {points.shape}")
    if not np.isfinite(points).all():
        raise SimError("a route's points must be finite")
    moved = np.any(np.diff(points, axis=0) != 0, axis=1)
    points = points[np.concatenate([[True], moved])] if len(points) else points
    if len(points) < 2:
        raise SimError(f"a route needs two different points, not {len(points)}")
    return points


class Projection(NamedTuple):
    """Path length up to the point of a polyline that is nearest to a pose, and how far that is from it [m, m]."""

    along: float
    off: float


class _Segment(NamedTuple):
    """From path length ``start`` to ``end`` [m]: its first corner ``x``, ``y`` [m], and its way ``east``, ``north``."""

    start: float
    end: float
    x: float
    y: float
    east: float
    north: float


class Polyline:
    """The polyline through ``points`` (n, 2) [m], as ``polyline`` takes them; beyond its ends it goes straight on.

    ``along`` (n,) [m] is the path length up to each point, of those that do not repeat the one before.
    """

    def __init__(self, points: ArrayLike) -> None:
        corners = polyline(points)
        steps = np.diff(corners, axis=0)
        lengths = np.hypot(*steps.T)
        self.along = np.concatenate([[0.0], np.cumsum(lengths)])
        self.length = float(self.along[-1])
        # In numbers of Python's: few segments are near, and each command to a robot projects on them.
        columns = self.along[:-1], self.along[1:], *corners[:-1].T, *(steps / lengths[:, None]).T
        self._segments = [_Segment(*row) for row in np.column_stack(columns).tolist()]
        self._starts = [segment.start for segment in self._segments]

    def pose(self, along: float, aside: float = 0.0, turned: float = 0.0) -> Pose:
        """The pose at ``along`` [m], ``aside`` to the left of the way [m], ``turned`` to its left [rad]."""
        on = self._segments[max(bisect_right(self._starts, along) - 1, 0)]
        ahead = along - on.start
        x, y = on.x + ahead * on.east - aside * on.north, on.y + ahead * on.north + aside * on.east
        return Pose(float(x), float(y), math.atan2(on.north, on.east) + turned)

    def project(self, pose: Pose, near: float | None = None, reach: float = REACH) -> Projection:
        """Find the point that is nearest to a pose.

        A way may pass a place twice: with ``near`` only what lies within ``reach`` of it [m along the way] counts.
        """
        window = (0.0, self.length) if near is None else (near - reach, near + reach)
        low, high = (min(max(bound, 0.0), self.length) for bound in window)
        best, nearest = low, math.inf
        for on in self._segments:
            if on.end < low or on.start > high:
                continue
            foot = on.start + ((pose.x - on.x) * on.east + (pose.y - on.y) * on.north)
            foot = min(max(foot, on.start, low), on.end, high)
            ahead = foot - on.start
            off = math.hypot(on.x + ahead * on.east - pose.x, on.y + ahead * on.north - pose.y)
            if off < nearest:
                best, nearest = foot, off
        return Projection(best, nearest)
