"""Write trajectories as TUM, KITTI or plain tables, each file in one step."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from refseq.errors import LogError
from refseq.files import naming_writes, replace_text
from refseq.logs.trajectories.table import TrajectoryFormat
from refseq.planar import Pose, wrap


def write_trajectory(path: Path, poses: Iterable[tuple[float, Pose]], form: TrajectoryFormat | str) -> None:
    """Write poses with their times [s], replacing ``path`` in one step.

    Planar poses become ones in space, z up: z, roll and pitch are 0. KITTI's rows have no time. Raises ``LogError``
    for a format that is not written, without a pose, and when the file cannot be written.
    """
    if form not in WRITERS:
        raise LogError(f"{path}: format {str(form)!r} is not written; valid are {', '.join(WRITERS)}")
    header, row = WRITERS[TrajectoryFormat(form)]
    lines = [row(time, pose) for time, pose in poses]
    if not lines:
        raise LogError(f"{path}: there is no pose to write; valid is at least one")
    with naming_writes(path, LogError):
        replace_text(path, "\n".join([*header, *lines]) + "\n")


def _tum(time: float, pose: Pose) -> str:
    half = wrap(pose.heading) / 2
    return f"{time:.9f} {pose.x:.9f} {pose.y:.9f} 0 0 0 {math.sin(half):.12f} {math.cos(half):.12f}"


def _kitti(_: float, pose: Pose) -> str:
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return f"{cos:.12f} {-sin:.12f} 0 {pose.x:.9f} {sin:.12f} {cos:.12f} 0 {pose.y:.9f} 0 0 1 0"


def _table(time: float, pose: Pose) -> str:
    return f"{time:.9f},{pose.x:.9f},{pose.y:.9f},{pose.heading:.12f}"


WRITERS: Mapping[TrajectoryFormat, tuple[tuple[str, ...], Callable[[float, Pose], str]]] = {
    TrajectoryFormat.TUM: (("# timestamp tx ty tz qx qy qz qw",), _tum),
    TrajectoryFormat.KITTI: ((), _kitti),
    TrajectoryFormat.TABLE: (("time [s],x [m],y [m],heading [rad]",), _table),
}
"""Header and row of each format that is written."""
