"""Where views come from: a drive to simulate, a log, or a folder of images."""

import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs import Recording, read_recording
from refseq.logs.thin import every, with_odometry_noise
from refseq.planar import Pose
from refseq.view import LASER, View
from scenarios.campaign.store.cache import RECORDING, DamagedError, Store
from scenarios.campaign.store.keys import key_of, recording_key
from scenarios.drives.inputs import stretch
from scenarios.drives.record import Drive, name_of_route
from scenarios.errors import ScenarioError

DATA = "REFSEQ_RECORDINGS"
"""Environment variable that names the folder of real recordings."""


class AbsentError(Exception):
    """A real recording is not on this machine: what needs it is skipped, with this reason."""


@dataclass(frozen=True, slots=True)
class Log:
    """A log in the folder of real recordings: the ``views`` FROM:TO of it, one every ``thin`` [m] (0: all).

    ``noise`` is the seed of the noise that its odometry is given, None: none, for logs whose odometry is a real one.
    """

    file: str
    views: str | None = None
    thin: float = 0.0
    noise: int | None = None


@dataclass(frozen=True, slots=True)
class Images:
    """A folder of images of one camera in the folder of real recordings, in the order of their names.

    There is no odometry: each view is ``spacing`` [m] after the last, and its true place is its number times that. The
    images are enlarged or shrunk to ``width`` [pixels].
    """

    folder: str
    spacing: float = 1.0
    width: int = 640


Source = Drive | Log | Images


def names_of(sources: Sequence[Source]) -> tuple[str, ...]:
    """A name for each of some sources, by what was driven; one that comes again has its number behind."""
    found: list[str] = []
    for number, name in enumerate(map(_name, sources)):
        while name in found:
            name = f"{name} ({number + 1})"
        found.append(name)
    return tuple(found)


def _name(source: Source) -> str:
    match source:
        case Log(file, views):
            return Path(file).stem + (f" {views}" if views else "")
        case Images(folder):
            return Path(folder).name
    return name_of_route(source)


def source_key(source: Source) -> str:
    """Key of a source's views. Raises ``AbsentError`` for a recording that is not on this machine."""
    if isinstance(source, Drive):
        return recording_key(source)
    path = real_path(source)
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    found = [(file.name, file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    return key_of(type(source).__name__, asdict(source), found)


def read_views(source: Source, key: str, store: Store) -> Recording:
    """The views of a source; those of a drive must be in the store, under its ``key``.

    Raises ``DamagedError`` for what the store holds, ``LogError`` and ``AbsentError`` for what was never put there.
    """
    if isinstance(source, Drive):
        return _read_kept(key, store)
    path = real_path(source)
    return _read_log(source, path) if isinstance(source, Log) else _read_images(source, path)


def _read_kept(key: str, store: Store) -> Recording:
    path = store.path(key, RECORDING)
    try:
        recording = read_recording(path)
    except (LogError, OSError) as error:
        raise DamagedError(key, str(error)) from error
    if not recording.complete:
        raise DamagedError(key, f"{path}: is damaged behind its first {len(recording.views)} views")
    return recording


def real_path(source: Log | Images) -> Path:
    """Where a real recording lies. Raises ``AbsentError``."""
    name = source.file if isinstance(source, Log) else source.folder
    home = os.environ.get(DATA)
    if home is None:
        raise AbsentError(f"{name}: the folder of real recordings is not known; valid is to name it in {DATA}")
    path = Path(home) / name
    if not path.exists():
        raise AbsentError(f"{path}: is not there; valid is a folder of real recordings in {DATA} that holds it")
    return path


def _read_log(log: Log, path: Path) -> Recording:
    recording = read_recording(path)
    views = recording.views[stretch(log.views, len(recording.views), path)]
    if log.noise is not None:
        views = with_odometry_noise(views, np.random.default_rng(log.noise))
    views = every(views, log.thin) if log.thin else views
    return Recording(views, {"world": path.name, **recording.metadata})


def _read_images(images: Images, folder: Path) -> Recording:
    """Each file that is an image as a view."""
    if not folder.is_dir():
        raise ScenarioError(f"{folder}: is no folder; valid is one of images")
    found = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted(folder.iterdir())]
    shown = [image for image in found if image is not None]
    if not shown:
        raise LogError(f"{folder}: holds no image; valid is a folder of images")
    views = tuple(
        View(
            time=float(number),
            images={"camera-1": _resized(image, images.width)},
            distance=images.spacing if number else 0.0,
            truth=Pose(images.spacing * number, 0.0, 0.0),
        )
        for number, image in enumerate(shown)
    )
    return Recording(views, {"world": f"{folder.parent.name}/{folder.name}"})


def _resized(image: NDArray[Any], width: int) -> NDArray[np.uint8]:
    height, now = image.shape
    size = width, max(1, math.floor(0.5 + height * width / now))
    return cv2.resize(image, size, interpolation=cv2.INTER_CUBIC).astype(np.uint8)


def only(view: View, sensors: tuple[str, ...] | None) -> View:
    """A view with some of its sensors; None: all."""
    if sensors is None:
        return view
    images = {name: image for name, image in view.images.items() if name in sensors}
    return replace(view, images=images, scan=view.scan if LASER in sensors else None)
