"""Real recordings: a log, or a folder of images, in the folder of those that this machine has."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs import Recording, read_recording
from refseq.logs.thin import every, with_odometry_noise
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.drives.selection import stretch
from refseq_bench.scenarios.errors import ScenarioError

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


def read_real(source: Log | Images) -> Recording:
    """The views of a real recording. Raises ``AbsentError``, ``LogError``, ``ScenarioError``."""
    path = real_path(source)
    return _read_log(source, path) if isinstance(source, Log) else _read_images(source, path)


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
