"""A polyline that is driven along: how far along it a point is, and where it leads."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose

REACH = 2.0
"""Distance along a path within which a robot is looked for again [m]: a choice, twice the way of a second."""


class Polyline:
    """The polyline through ``points`` (n, 2) [m]; points that repeat the one before them are left out."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        points = np.asarray(points, np.float64)
        moved = np.any(np.diff(points, axis=0) != 0, axis=1)
        self.points = points[np.concatenate([[True], moved])]
        steps = np.diff(self.points, axis=0)
        lengths = np.hypot(*steps.T)
        self._tangents = steps / lengths[:, None]
        self.along = np.concatenate([[0.0], np.cumsum(lengths)])
        """Path length up to each point, (n,) [m]."""

    @property
    def length(self) -> float:
        """All of it [m]."""
        return float(self.along[-1])

    def pose(self, along: float, aside: float = 0.0, turned: float = 0.0) -> Pose:
        """The pose at ``along`` [m], ``aside`` to the left of the way [m], ``turned`` to its left [rad]."""
        i = min(max(int(self.along.searchsorted(along, side="right")) - 1, 0), len(self._tangents) - 1)
        ahead, left = self._tangents[i], np.array([-self._tangents[i, 1], self._tangents[i, 0]])
        x, y = self.points[i] + (along - self.along[i]) * ahead + aside * left
        return Pose(float(x), float(y), math.atan2(ahead[1], ahead[0]) + turned)

    def project(self, pose: Pose, near: float | None = None) -> tuple[float, float]:
        """Path length up to the nearest point, and the pose's distance from it [m, m].

        A way may pass a place twice: with ``near`` only what lies within ``REACH`` of it [m along the way] counts.
        """
        offset = np.array([pose.x, pose.y]) - self.points[:-1]
        along = self.along[:-1] + np.sum(offset * self._tangents, axis=1)
        along = np.clip(along, self.along[:-1], self.along[1:])
        if near is not None:
            along = np.clip(along, max(near - REACH, 0.0), min(near + REACH, self.length))
        x = np.interp(along, self.along, self.points[:, 0])
        y = np.interp(along, self.along, self.points[:, 1])
        gaps = np.hypot(x - pose.x, y - pose.y)
        best = int(np.argmin(gaps))
        return float(along[best]), float(gaps[best])
