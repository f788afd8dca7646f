"""A folder of pictures as a log: one camera, no odometry, times from the names where they are times."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.files import open_input
from refseq.limits import FILES, PICTURE_BYTES
from refseq.logs.decoding.picture import CompressedPicture, DepthPictureError, check_size
from refseq.logs.pictures.names import PICTURES, in_order
from refseq.logs.source import Channel, Role, Sample
from refseq.logs.unreadable import ALL_READABLE
from refseq.planar import Pose
from refseq.view import ASSUMED

CAMERA_TOPIC, ASSUMED_TOPIC = "/camera-1", "/assumed-odometry"

MOST_NAMED = 3
"""So many pictures are named in a note."""

WIDTH = 640
"""Pictures are made so many pixels wide, at which features are sought: smaller ones show few, larger ones take long."""


def holds_pictures(path: Path) -> bool:
    """Tell whether a folder holds at least one picture, by the files' names."""
    return path.is_dir() and any(file.suffix.lower() in PICTURES and file.name[0] != "." for file in path.iterdir())


@dataclass(frozen=True, slots=True)
class FilePicture:
    """A picture's file that is read when it is asked for; ``width`` [pixels] is that of the result, 0: as it is."""

    path: Path
    width: int = WIDTH
    is_depth = False  # never told beforehand: the file is not opened

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.path.name

    @property
    def encoding(self) -> str:
        """Format by the file's name."""
        return self.path.suffix.lower().removeprefix(".")

    def check(self) -> tuple[int, int]:
        """Width and height in the file [pixels]. Raises ``LogError`` with its name for one that ``decode`` refuses."""
        with self._named():
            size = self._compressed().check()
            self._wanted(*size)
            return size

    def decode(self) -> NDArray[np.uint8]:
        """Grey pixels. Raises ``LogError`` with the file's name for one that is no picture of 8 bits."""
        with self._named():
            return self._resized(self._compressed().decode())

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except LogError as error:
            raise type(error)(f"{self.name}: {error}") from error

    def _compressed(self) -> CompressedPicture:
        picture = CompressedPicture(_content(self.path), self.encoding)
        if picture.is_depth:
            raise DepthPictureError("is of 16 bits, as distances are; valid are pictures of 8 bits")
        return picture

    def _wanted(self, width: int, height: int) -> tuple[int, int]:
        """Size of the result. Raises ``LogError`` for a picture of a column, which would become a tower."""
        check_size(width, height)
        wanted = self.width or width, max(1, int(0.5 + height * (self.width or width) / width))
        check_size(*wanted)
        return wanted

    def _resized(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        height, width = image.shape
        wanted = self._wanted(width, height)
        if wanted == (width, height):
            return image
        return np.asarray(cv2.resize(image, wanted, interpolation=cv2.INTER_CUBIC), np.uint8)


def _content(path: Path) -> bytes:
    try:
        with open_input(path) as file:
            PICTURE_BYTES.check(path.stat().st_size, "has")
            return file.read()
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}") from error


class PictureFolder:
    """The pictures of a folder in the natural order of their names, each a moment of its own.

    There is no odometry: each picture is taken as ``spacing`` [m] on from the last, and ``metadata`` say so. ``times``
    [s] are those in the names (EuRoC, TUM), which pictures of other names are left out for where they are few, or else
    there is one picture a second. ``width`` [pixels] is that of all
    views. Raises ``LogError`` without a picture.
    """

    kind = "a folder of pictures"
    complete = True
    damage = ""
    has_moments = True
    unreadable = ALL_READABLE

    def __init__(self, path: Path, *, spacing: float = 1.0, width: int = WIDTH) -> None:
        self.path = path
        self._spacing, self._width = spacing, width
        entries = [file for file in islice(path.iterdir(), FILES + 1) if not (file.name[0] == "." or file.is_dir())]
        FILES.check(len(entries), f"{path}: has")
        self._ordered = in_order([file for file in entries if file.suffix.lower() in PICTURES])
        self.files, stamps = self._ordered.files, self._ordered.times
        if not self.files:
            raise LogError(f"{path}: holds no picture; valid are {', '.join(PICTURES)}")
        self.times = np.arange(len(self.files), dtype=np.float64) if stamps is None else stamps
        self._others = Counter(
            file.suffix.lower() or file.name for file in entries if file.suffix.lower() not in PICTURES
        )

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height of the first picture that is whole. Raises ``LogError`` for the first where none is."""
        reasons = []
        for file in self.files:
            try:
                return FilePicture(file, self._width).check()
            except LogError as error:
                reasons.append(f"{self.path}: {error}")
        raise LogError(reasons[0])

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The camera, and the way that is assumed."""
        count, formats = len(self.files), sorted({file.suffix.lower().removeprefix(".") for file in self.files})
        return (
            Channel(ASSUMED_TOPIC, f"{self._spacing:g} m a picture", ASSUMED, count, Role.ODOMETRY),
            Channel(CAMERA_TOPIC, "picture", "+".join(formats), count, Role.CAMERA),
        )

    @property
    def metadata(self) -> Mapping[str, str]:
        """The folder's name, and what is assumed."""
        width, height = self.size
        notes = {
            "world": f"{self.path.absolute().parent.name}/{self.path.absolute().name}",
            "odometry": f"{ASSUMED}: {self._spacing:g} m a picture",
            "times": self._times_by(),
        }
        if self._width not in (0, width):
            notes["images"] = f"{width} × {height} pixels, made {self._width} wide"
        return notes

    def _times_by(self) -> str:
        """Origin of the times; behind a semicolon the names that are unlike the others."""
        without = self._ordered.without
        names = ", ".join(file.name for file in without[:MOST_NAMED]) + (", …" if len(without) > MOST_NAMED else "")
        if self._ordered.times is not None:
            return "by the pictures' names" + (f"; left out, as they tell none: {names}" if without else "")
        return f"{ASSUMED}: one picture a second" + (f"; no time is told by {names}" if without else "")

    @property
    def skipped(self) -> Mapping[str, int]:
        """Files that are no pictures, by the ending of their names."""
        return dict(self._others)

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Pictures and assumed poses, in order."""
        wanted = {ASSUMED_TOPIC, CAMERA_TOPIC} if topics is None else set(topics)
        for number, (file, time) in enumerate(zip(self.files, self.times.tolist(), strict=True)):
            if ASSUMED_TOPIC in wanted:
                pose = Pose(self._spacing * number, 0.0, 0.0)
                yield Sample(ASSUMED_TOPIC, time, time, "", pose, moment=number)
            if CAMERA_TOPIC in wanted:
                picture = FilePicture(file, self._width)
                yield Sample(CAMERA_TOPIC, time, time, "", picture, moment=number)
