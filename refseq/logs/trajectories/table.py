"""Poses of a trajectory file: by time, or by the number of the picture or scan that they belong to."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq.errors import LogError
from refseq.logs.trajectory import Trajectory
from refseq.planar import Pose


class TrajectoryFormat(StrEnum):
    """Formats of trajectory files."""

    TUM = "tum"
    KITTI = "kitti"
    EUROC = "euroc"
    TABLE = "csv"
    RELATIONS = "relations"


@dataclass(frozen=True)
class PoseTable:
    """Poses (n, 3) of x, y [m] and heading [rad] as a file has them, each with its key, rising.

    A key (n,) is a time [s], or where ``numbered`` the number of a picture or scan of the log, from 0. ``source`` is
    the file, for messages; ``notes`` say in words what was assumed on reading it.
    """

    source: Path
    form: TrajectoryFormat
    keys: NDArray[np.float64]
    poses: NDArray[np.float64]
    numbered: bool = False
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.keys)

    def __iter__(self) -> Iterator[tuple[float, Pose]]:
        """Each key with its pose."""
        return ((key, Pose(*pose)) for key, pose in zip(self.keys.tolist(), self.poses.tolist(), strict=True))

    def timed(self, stamps: ArrayLike = ()) -> Trajectory:
        """The poses by time: those of a numbered table take the times of a log's pictures or scans, (m,) [s].

        Raises ``LogError`` where a number is beyond them, and where a KITTI file has not as many rows as there are.
        """
        if not self.numbered:
            return Trajectory(self.keys, self.poses)
        times = np.asarray(stamps, dtype=np.float64)
        if self.form is TrajectoryFormat.KITTI and len(self) != len(times):
            raise LogError(
                f"{self.source}: has {len(self)} poses without times, the log {len(times)} pictures or scans; valid is "
                "one for each, or a file of their times"
            )
        if (last := int(self.keys[-1])) >= len(times):
            raise LogError(
                f"{self.source}: holds a pose for picture or scan {last}; valid are 0 to {len(times) - 1}, as many as "
                "the log has"
            )
        return Trajectory.of(times[self.keys.astype(np.intp)].tolist(), (pose for _, pose in self))

    def within(self, begin: float, end: float, log: Path, stamps: ArrayLike = (), late: float = 0.0) -> Trajectory:
        """As ``timed``, set back by what they are ``late`` [s], for a log from ``begin`` to ``end`` [s].

        Raises ``LogError`` where no pose lies within that.
        """
        timed = self.timed(stamps).earlier(late)
        if timed.times[0] <= end and begin <= timed.times[-1]:
            return timed
        raise LogError(
            f"{self.source}: runs from {timed.times[0]:.3f} to {timed.times[-1]:.3f} s, {log} from {begin:.3f} to "
            f"{end:.3f} s; valid is a trajectory of the same time, or sensors late by what their clock differs"
        )
