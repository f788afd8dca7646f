"""Walls of a scan, for another to be laid on it: met, or seen through."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

TOLERANCE, GROWING = 0.1, 0.02
"""Walls are the same within so much [m], and so much more a metre of range: noise, and views that tilt or turn."""


class ScanWalls:
    """A scan by degrees, (360,) [m]: the ends of its beams, ``points`` (n, 2), and the range of walls about each.

    There are no walls where nothing came back.
    """

    def __init__(self, ranges: NDArray[np.float64]) -> None:
        degrees = np.flatnonzero(ranges > 0)
        self.points = ranges[degrees, None] * np.stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], 1)
        about = np.stack([np.roll(ranges, 1), ranges, np.roll(ranges, -1)])
        known = ranges > 0
        self._nearest = np.where(known, np.where(about > 0, about, np.inf).min(axis=0), -np.inf)
        self._farthest = np.where(known, about.max(axis=0), -np.inf)

    def met(self, points: NDArray[np.float64], poses: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Points (n, 2) of a scan that is at some poses (m, 3) here: those at walls (m,), and those seen through (m,).

        A point behind a wall is hidden, and tells nothing; the other scan sees through that wall.
        """
        return self.met_by(seen_from(points, poses))

    def met_by(self, seen: "SeenPoints") -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The same of points as they are seen from here."""
        at_walls, through = self.told_of(seen)
        return at_walls.sum(axis=1), through.sum(axis=1)

    def told_of(self, seen: "SeenPoints") -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which of some points are at walls, and which are seen through, (m, n) each."""
        through = seen.reach < self._nearest[seen.degrees] - seen.off
        return ~through & (seen.reach <= self._farthest[seen.degrees] + seen.off), through


class SeenPoints(NamedTuple):
    """Points of a scan at some poses, (m, n) each, as seen from where another scan was taken.

    They are at ``degrees``, some of them negative, at a ``reach`` [m]; walls may be ``off`` by so much [m].
    """

    degrees: NDArray[np.intp]
    reach: NDArray[np.float64]
    off: NDArray[np.float64]


def seen_from(points: NDArray[np.float64], poses: NDArray[np.float64]) -> SeenPoints:
    """Points (n, 2) of a scan that is at some poses (m, 3)."""
    east, north, heading = poses.T[:, :, None]
    ahead, left = points.T
    cos, sin = np.cos(heading), np.sin(heading)
    x, y = east + cos * ahead - sin * left, north + sin * ahead + cos * left  # as ``moved`` has them, (m, n)
    reach = np.sqrt(x * x + y * y)  # a third of the time that hypot takes, whose range nobody needs
    # Negative degrees count from the end of a table, as they should.
    return SeenPoints(np.round(np.degrees(np.arctan2(y, x))).astype(np.intp), reach, TOLERANCE + GROWING * reach)
