"""Real recordings: a log or a folder of images, beside the scenario's file or in the folder of those at hand."""

import os
from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np

from refseq.logs import PairingOptions, Recording, Role, open_log, plan_views
from refseq.logs.pictures.source import PictureFolder
from refseq.logs.trajectories import PoseTable, read_trajectory
from refseq.planar import Pose
from refseq_bench.scenarios.campaign.declare.sources import Images, Log
from refseq_bench.scenarios.drives.left_out import check_all_views, views_left_out
from refseq_bench.scenarios.drives.selection import names_by_topic, stretch
from refseq_bench.scenarios.errors import ScenarioError

DATA = "REFSEQ_RECORDINGS"
"""Environment variable that names the folder of real recordings."""


class AbsentError(Exception):
    """A real recording is not on this machine: what needs it is skipped, with this reason."""


def names_in(source: Log | Images) -> tuple[str, ...]:
    """All files that a real recording is read from, by the names that the scenario has: itself, and its poses."""
    if isinstance(source, Images):
        return (source.folder,)
    return (source.file, *(name for name in (source.truth, source.odometry) if name and not _is_topic(name)))


def _is_topic(name: str) -> bool:
    """Tell a topic from a trajectory's file, which need not be there: it begins with a stroke and has no ending."""
    return name.startswith("/") and not PurePath(name).suffix


def real_paths(source: Log | Images) -> tuple[Path, ...]:
    """Where all that a real recording is read from lies. Raises ``AbsentError``."""
    return tuple(_path_of(name, source.beside) for name in names_in(source))


def place_below(name: str) -> Path:
    """Where a name lies in the folder of real recordings that another machine is sent: nowhere outside of it."""
    path = PurePath(name)
    return Path(*(part for part in path.parts if part not in (path.anchor, "..")))


def _path_of(name: str, beside: Path | None) -> Path:
    """Where a name lies: beside the scenario, or in the folder of real recordings. Raises ``AbsentError``."""
    home = os.environ.get(DATA)
    homes = [Path(home, name), Path(home, place_below(name))] if home is not None else []
    places = [Path(beside or "/", name)] if beside is not None or Path(name).is_absolute() else []
    if (found := next((path for path in (*places, *homes) if path.exists()), None)) is not None:
        return found
    if Path(name).is_absolute():
        raise AbsentError(f"{name}: is not there; valid is a recording that is")
    folders = " nor in ".join(str(folder) for folder in (beside, home) if folder is not None) or "any folder"
    none = "" if home is not None else ", now none"
    raise AbsentError(
        f"{name}: is not in {folders}; valid is one beside the scenario, or in the folder that {DATA} names{none}"
    )


def read_real(source: Log | Images) -> Recording:
    """The views of a real recording. Raises ``AbsentError``, ``LogError``, ``ScenarioError``."""
    path, *_ = real_paths(source)
    return _read_log(source, path) if isinstance(source, Log) else _read_images(source, path)


def _read_log(log: Log, path: Path) -> Recording:
    plan = plan_views(open_log(path), _pairing_options(log))
    plan = plan.between(stretch(log.views, len(plan), path))
    if log.truth is not None:
        from refseq_bench.scenarios.drives.truth.fit import check_truth  # its solver, which who lists does not wait for

        check_truth(plan.views, log.truth, path.name, log.late.get(Role.TRUTH, 0.0))
    if log.noise is not None:
        plan = plan.with_noise(np.random.default_rng(log.noise))
    recording = (plan.thinned(log.thin) if log.thin else plan).recording()
    return replace(recording, metadata={"world": path.name, **recording.metadata})


def _pairing_options(log: Log) -> PairingOptions:
    return PairingOptions(
        names=names_by_topic(log.topics),
        tolerance=log.tolerance,
        late=log.late,
        odometry=_poses_of(log.odometry, log.beside),
        truth=_poses_of(log.truth, log.beside),
    )


def _poses_of(name: str | None, beside: Path | None) -> str | PoseTable | None:
    """A topic as it is, or the poses in a file. Raises ``AbsentError``, ``LogError``."""
    return name if name is None or _is_topic(name) else read_trajectory(_path_of(name, beside))


def _read_images(images: Images, folder: Path) -> Recording:
    """Each picture as a view, and its true place on the line of pictures."""
    if not folder.is_dir():
        raise ScenarioError(f"{folder}: is no folder; valid is one of images")
    recording = plan_views(PictureFolder(folder, spacing=images.spacing, width=images.width)).recording()
    check_all_views(views_left_out(recording), folder)
    views = tuple(
        replace(view, truth=Pose(images.spacing * number, 0.0, 0.0)) for number, view in enumerate(recording.views)
    )
    return replace(recording, views=views)
