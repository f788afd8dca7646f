"""Views written as a log."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from refseq.errors import LogError
from refseq.files import naming_writes, replace_text
from refseq.logs.carmen.layouts import NO_RETURN, REACH, flaser_step, least_unseen, reach_told
from refseq.planar import Pose, after_motion
from refseq.view import Scan, View


def write_carmen(path: Path | str, views: Sequence[View], metadata: Mapping[str, str] | None = None) -> None:
    """Write the scans of ``views`` as a CARMEN log, replacing ``path`` in one step.

    A view whose true pose and odometry are known is a FLASER line, which has no angles; for scans of other angles or
    another range than it stands for, ROBOTLASER1. Both have places for both poses, so that others are RAWLASER1 lines
    with an ODOM line before them, or TRUEPOS: what nobody measured is not made up, and read again it is not there.

    Images have no place in the format, nor spaces and line ends in a metadata value: they become underscores. The
    odometer pose is the sum of the views' motions from the first one's truth. Raises ``LogError`` when no view has a
    scan, and when the file cannot be written.
    """
    path = Path(path)
    scans = [view.scan for view in views if view.scan is not None]
    if not scans:
        raise LogError(f"{path}: a CARMEN log holds laser scans; none of the {len(views)} views has one")
    reach = float(scans[0].max_range)
    told = dict(metadata or {}) | ({REACH: f"{reach:g}"} if float(f"{reach:g}") == reach < NO_RETURN else {})
    words = {name: as_word(value) for name, value in told.items()}
    lines = [f"PARAM {name} {word} 0 refseq 0" for name, word in words.items() if word]
    measured = any(view.has_odometry for view in views)
    odometry = next((view.truth for view in views if view.scan is not None), None) or Pose(0.0, 0.0, 0.0)
    for index, view in enumerate(views):
        if index:
            odometry = after_motion(odometry, view.distance, view.turn)
        if view.scan is not None:
            lines += _laser_lines(view, view.scan, odometry if measured else None, reach_told(words))
    with naming_writes(path, LogError):
        replace_text(path, "\n".join(lines) + "\n")


def as_word(value: str) -> str:
    """A value as a line's single word: blanks and line ends become underscores, those at its ends are gone."""
    return "_".join(value.split())


def _laser_lines(view: View, scan: Scan, odometry: Pose | None, reach: float) -> list[str]:
    """A scan and the poses that are known with it; ``reach`` [m] is what FLASER stands for."""
    ranges, stamps = _ranges_text(scan), f"{view.time:.6f} refseq {view.time:.6f}"
    if view.truth is not None and odometry is not None:
        poses = f"{_pose_text(view.truth)} {_pose_text(odometry)}"
        if _as_flaser_says(scan, reach):
            return [f"FLASER {ranges} {poses} {stamps}"]
        return [f"ROBOTLASER1 {_head_text(scan)} {ranges} 0 {poses} 0 0 0 0 0 {stamps}"]
    known = [f"TRUEPOS {_pose_text(view.truth)} 0 0 0 {stamps}"] if view.truth is not None else []
    known += [f"ODOM {_pose_text(odometry)} 0 0 0 {stamps}"] if odometry is not None else []
    return [*known, f"RAWLASER1 {_head_text(scan)} {ranges} 0 {stamps}"]


def _ranges_text(scan: Scan) -> str:
    """The number of ranges and each, in millimetres' steps; what came back is never rounded to what did not."""
    nothing = max(scan.max_range, NO_RETURN)
    limit = least_unseen(scan.max_range)
    below = math.ceil(limit * 1000 - 1e-6) / 1000 - 0.001
    ranges = scan.ranges.astype(np.float64)
    reach = np.where(ranges < limit, np.minimum(np.round(ranges, 3), below), nothing)
    return f"{len(reach)} {' '.join(f'{r:.3f}'.rstrip('0').rstrip('.') for r in reach)}"


def _pose_text(pose: Pose) -> str:
    return f"{pose.x:.6f} {pose.y:.6f} {pose.heading:.6f}"


def _head_text(scan: Scan) -> str:
    width = scan.step * (len(scan.ranges) - 1)
    return f"0 {scan.start:.9f} {width:.9f} {scan.step:.9f} {scan.max_range:g} 0.01 0"


def _as_flaser_says(scan: Scan, reach: float) -> bool:
    """True where a reader of FLASER takes each beam for the direction that it has, within a tenth of a step."""
    if abs(scan.max_range - reach) > 1e-6:
        return False
    n, step = len(scan.ranges), flaser_step(len(scan.ranges))
    farthest = abs(scan.start + math.pi / 2) + abs(scan.step - step) * n
    return farthest < step / 10
