"""Pictures of views within a bound of memory: encoded until somebody asks for them, then the first ones decoded."""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.decoding.picture import CompressedPicture, LazyPicture, check_size, declared_size
from refseq.logs.pictures.source import FilePicture

HELD = 128 << 20
"""Bytes of pixels that a drive's views hold. More spares decoding a long drive's pictures for each that asks; less
makes room for longer drives."""

LATEST = 16
"""So many pictures that were decoded last are kept, for those who ask twice for one of a view."""


class EncodedPicture:
    """A compressed picture of a topic, decoded when somebody asks; while there is room its pixels take its place."""

    def __init__(self, store: "PictureStore", topic: str, picture: CompressedPicture | FilePicture) -> None:
        self._store, self._topic = store, topic
        self._held: CompressedPicture | FilePicture | NDArray[np.uint8] = picture

    def pixels(self) -> NDArray[np.uint8]:
        """Grey pixels, (height, width). Raises ``LogError`` with file and topic for a picture that is damaged."""
        held = self._held
        return held if isinstance(held, np.ndarray) else _latest(self)

    def decoded(self) -> NDArray[np.uint8]:
        """The pixels, decoded now and held if there is room."""
        held = self._held
        if isinstance(held, np.ndarray):
            return held
        pixels = self._store.decoded(self._topic, held)
        if self._store.has_room(pixels.nbytes):
            self._held = pixels
        return pixels


_latest = lru_cache(maxsize=LATEST)(EncodedPicture.decoded)


class ViewImages(Mapping[str, NDArray[np.uint8]]):
    """A view's images by camera, as a mapping that nobody can change."""

    def __init__(self, pictures: Mapping[str, NDArray[np.uint8] | EncodedPicture]) -> None:
        self._pictures = dict(pictures)

    def __getitem__(self, camera: str) -> NDArray[np.uint8]:
        held = self._pictures[camera]
        return held.pixels() if isinstance(held, EncodedPicture) else held

    def __contains__(self, camera: object) -> bool:
        return camera in self._pictures  # a mapping's own would decode the picture

    def __iter__(self) -> Iterator[str]:
        return iter(self._pictures)

    def __len__(self) -> int:
        return len(self._pictures)

    def __repr__(self) -> str:
        return f"ViewImages({', '.join(self._pictures)})"


class PictureStore:
    """Takes the pictures of one drive, and holds each topic to one size."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._held = 0
        self._sizes: dict[str, tuple[int, int]] = {}
        self._shown: dict[str, tuple[int, int]] = {}  # decoded, a picture of which the head says so is turned

    def taken(self, topic: str, picture: LazyPicture) -> NDArray[np.uint8] | EncodedPicture:
        """The picture if it is compressed or a file, for whoever asks; the pixels of any other, which are smaller.

        Raises ``LogError`` for one of which the head is damaged or tells another size than those before.
        """
        if isinstance(picture, FilePicture):
            return EncodedPicture(self, topic, picture)
        if not isinstance(picture, CompressedPicture):
            return self.decoded(topic, picture)
        try:
            size = declared_size(picture.data)
            check_size(*size)
        except LogError as error:
            raise self._named(topic, error) from error
        self._check(topic, size, self._sizes)
        return EncodedPicture(self, topic, picture)

    def decoded(self, topic: str, picture: LazyPicture) -> NDArray[np.uint8]:
        """Grey pixels, (height, width). Raises ``LogError`` for a picture that is damaged or of another size."""
        try:
            pixels = picture.decode()
        except LogError as error:
            raise self._named(topic, error) from error
        self._check(topic, (pixels.shape[1], pixels.shape[0]), self._shown)
        return pixels

    def has_room(self, count: int) -> bool:
        """Tell whether so many bytes of pixels more may be held; if so they are counted."""
        if self._held + count > HELD:
            return False
        self._held += count
        return True

    def _check(self, topic: str, size: tuple[int, int], sizes: dict[str, tuple[int, int]]) -> None:
        first = sizes.setdefault(topic, size)
        if size != first:
            told = f"{size[0]} × {size[1]} pixels, the first {first[0]} × {first[1]}"
            raise self._named(topic, f"an image is {told}; valid is one size a topic")

    def _named(self, topic: str, reason: object) -> LogError:
        return LogError(f"{self._path}: topic {topic}: {reason}")
