"""Walls of a scan, for another to be laid on it: met, or seen through."""

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
        east, north, heading = poses.T[:, :, None]
        ahead, left = points.T
        cos, sin = np.cos(heading), np.sin(heading)
        x, y = east + cos * ahead - sin * left, north + sin * ahead + cos * left  # as ``moved`` has them, (m, n)
        reach = np.sqrt(x * x + y * y)  # a third of the time that hypot takes, whose range nobody needs
        # Negative degrees count from the end of a table, as they should.
        degrees, off = np.round(np.degrees(np.arctan2(y, x))).astype(np.intp), TOLERANCE + GROWING * reach
        through = reach < self._nearest[degrees] - off
        at_walls = ~through & (reach <= self._farthest[degrees] + off)
        return at_walls.sum(axis=1), through.sum(axis=1)
