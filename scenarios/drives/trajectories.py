"""Trajectories of a localised drive: the estimate, the odometry and the truth, for evo and its like."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from refseq.belief import Belief
from refseq.dead_reckoning import dead_reckoned
from refseq.logs.trajectories import TrajectoryFormat, write_trajectory
from refseq.map.map import Map, MapFrame
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError

ESTIMATE, ODOMETRY, TRUTH = "estimate", "odometry", "truth"
Poses = list[Pose | None]


@dataclass(frozen=True, slots=True)
class TrajectoryFile:
    """A file that was written: how many of the ``views`` have a pose in it."""

    path: Path
    poses: int
    views: int


def trajectory_path(output: Path, what: str, form: TrajectoryFormat) -> Path:
    """Name of a trajectory beside the beliefs: ``beliefs.parquet`` and ``beliefs-estimate.tum``."""
    return output.with_name(f"{output.stem}-{what}.{form}")


def check_frame(map_: Map, file: Path) -> None:
    """Raise ``ScenarioError`` for a map whose places have no poses, so that a belief has none."""
    if map_.frame is MapFrame.NONE:
        raise ScenarioError(
            f"{file}: knows no poses of its places, so that a belief has none; valid with --trajectory is a map of a "
            "drive with true poses, or of one drive with odometry"
        )


def write_trajectories(
    map_: Map, views: Sequence[View], beliefs: Sequence[Belief], output: Path, form: TrajectoryFormat
) -> list[TrajectoryFile]:
    """Write what there is of estimate, odometry and truth beside ``output``, each file in one step.

    Views without a pose are left out; the rows of KITTI files have no times, so that there a view is in all files or in
    none, and row k of each is the same view. Raises ``LogError`` where a file cannot be written.
    """
    found = {name: poses for name, poses in _poses(map_, views, beliefs).items() if any(poses)}
    if form is TrajectoryFormat.KITTI:
        whole = [all(row) for row in zip(*found.values(), strict=True)]
        found = {name: _kept(poses, whole) for name, poses in found.items()}
    files = []
    for name, poses in found.items():
        kept = [(view.time, pose) for view, pose in zip(views, poses, strict=True) if pose is not None]
        path = trajectory_path(output, name, form)
        write_trajectory(path, kept, form)
        files.append(TrajectoryFile(path, len(kept), len(views)))
    return files


def _kept(poses: Poses, which: Sequence[bool]) -> Poses:
    return [pose if keep else None for pose, keep in zip(poses, which, strict=True)]


def _poses(map_: Map, views: Sequence[View], beliefs: Sequence[Belief]) -> dict[str, Poses]:
    """Poses of each view, by what they are; the odometry begins at the first true pose where that is known."""
    odometry = [Pose(*row) for row in dead_reckoned(views, views[0].truth if views else None).tolist()]
    return {
        ESTIMATE: [map_.pose(belief) for belief in beliefs],
        ODOMETRY: list(odometry),
        TRUTH: [view.truth for view in views],
    }
