"""Trajectories: poses in the plane over time, and their interpolation."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq.planar import Pose, wrapped


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Poses over time: ``times`` (n,) [s], rising; ``poses`` (n, 3): x, y [m] and heading [rad]."""

    times: NDArray[np.float64]
    poses: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.times)

    @classmethod
    def of(cls, times: Iterable[float], poses: Iterable[Pose]) -> "Trajectory":
        """A trajectory in the order of time; of several poses with one stamp the last counts."""
        stamps = np.array(list(times), dtype=np.float64)
        values = np.array([(pose.x, pose.y, pose.heading) for pose in poses], dtype=np.float64).reshape(-1, 3)
        order = np.argsort(stamps, kind="stable")
        stamps, values = stamps[order], values[order]
        last = np.append(stamps[1:] != stamps[:-1], True) if len(stamps) else np.zeros(0, bool)
        return cls(stamps[last], values[last])

    @property
    def length(self) -> float:
        """Length of the way [m]."""
        return float(np.hypot(*np.diff(self.poses[:, :2], axis=0).T).sum())

    def earlier(self, seconds: float) -> "Trajectory":
        """The same poses, each so much earlier [s]."""
        return Trajectory(self.times - seconds, self.poses) if seconds else self

    def between(self, begin: float, end: float) -> "Trajectory":
        """The poses from ``begin`` to ``end`` [s], both among them."""
        within = (self.times >= begin) & (self.times <= end)
        return Trajectory(self.times[within], self.poses[within])

    def at(self, times: ArrayLike, reach: float = 0.0) -> NDArray[np.float64]:
        """Poses at other ``times``, (m, 3); NaN where the trajectory says nothing.

        Between two poses the position is interpolated linearly and the heading the short way round; a time that is
        one of the trajectory's own gets its pose unchanged. Before the first pose, behind the last and in the middle
        of a gap, the nearest pose stands if it is at most ``reach`` [s] away; a gap is a step of more than ``GAP``
        seconds and of more than ten times the median one.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
        if not len(self):
            return np.full((len(wanted), 3), np.nan)
        after = np.searchsorted(self.times, wanted).clip(0, len(self) - 1)
        before = np.where(self.times[after] > wanted, after - 1, after).clip(0)
        span = self.times[after] - self.times[before]
        share = np.divide(wanted - self.times[before], span, out=np.zeros_like(wanted), where=span > 0)[:, None]
        found: NDArray[np.float64] = _between(self.poses[before], self.poses[after], share.clip(0, 1))
        to_before, to_after = np.abs(wanted - self.times[before]), np.abs(self.times[after] - wanted)
        apart = np.minimum(to_before, to_after)
        alone = (wanted < self.times[0]) | (wanted > self.times[-1]) | (span > self.gap)
        nearest = np.where(to_after < to_before, after, before)
        found = np.where(alone[:, None], self.poses[nearest], found)
        found[alone & (apart > reach)] = np.nan
        return found

    @property
    def gap(self) -> float:
        """The longest step between two poses that is bridged [s]."""
        return max(GAP, 10 * float(np.median(np.diff(self.times)))) if len(self) > 1 else GAP


GAP = 1.0
"""A hole of more than so many seconds is not bridged: a smaller number gives up sooner, a larger one lets the robot cut
corners on a straight line."""


def _between(
    before: NDArray[np.float64], after: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Poses a ``share`` (m, 1) of the way from one to the other; exact at both ends."""
    step = after - before
    moved = before + share * np.column_stack([step[:, :2], wrapped(step[:, 2])])
    return np.where(share == 0, before, np.where(share == 1, after, moved))
