"""Pictures of views within a bound of memory: the first ones decoded, later ones encoded until they are asked for."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.decoding.picture import CompressedPicture, LazyPicture, check_size, declared_size

HELD = 128 << 20
"""Bytes of pixels that a drive's views hold. More spares decoding a long drive's pictures for each that asks; less
makes room for longer drives."""

LATEST = 16
"""So many pictures that were decoded last are kept, for those who ask twice for one of a view."""


@dataclass(frozen=True, slots=True, eq=False)
class EncodedPicture:
    """A picture of a topic that is decoded when somebody asks for its pixels."""

    path: Path
    topic: str
    picture: LazyPicture

    def pixels(self) -> NDArray[np.uint8]:
        """Grey pixels, (height, width). Raises ``LogError`` with file and topic for a picture that is damaged."""
        try:
            return self.picture.decode()
        except LogError as error:
            raise LogError(f"{self.path}: topic {self.topic}: {error}") from error


_latest = lru_cache(maxsize=LATEST)(EncodedPicture.pixels)


class ViewImages(Mapping[str, NDArray[np.uint8]]):
    """A view's images by camera, as a mapping that nobody can change."""

    def __init__(self, pictures: Mapping[str, NDArray[np.uint8] | EncodedPicture]) -> None:
        self._pictures = dict(pictures)

    def __getitem__(self, camera: str) -> NDArray[np.uint8]:
        held = self._pictures[camera]
        return _latest(held) if isinstance(held, EncodedPicture) else held

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

    def taken(self, topic: str, picture: LazyPicture) -> NDArray[np.uint8] | EncodedPicture:
        """The picture's pixels while there is room; beyond that the picture, if it is smaller than its pixels.

        Raises ``LogError`` for one that is damaged or of another size than those before.
        """
        kept = EncodedPicture(self._path, topic, picture)
        if self._held > HELD and isinstance(picture, CompressedPicture):
            self._check(kept, *_size_of(kept, picture))
            return kept
        pixels = kept.pixels()
        self._check(kept, pixels.shape[1], pixels.shape[0])
        self._held += pixels.nbytes
        return pixels

    def _check(self, kept: EncodedPicture, width: int, height: int) -> None:
        first = self._sizes.setdefault(kept.topic, (width, height))
        if (width, height) != first:
            raise LogError(
                f"{kept.path}: topic {kept.topic}: an image is {width} × {height} pixels, the first {first[0]} × "
                f"{first[1]}; valid is one size a topic"
            )


def _size_of(kept: EncodedPicture, picture: CompressedPicture) -> tuple[int, int]:
    try:
        width, height = declared_size(picture.data)
        check_size(width, height)
    except LogError as error:
        raise LogError(f"{kept.path}: topic {kept.topic}: {error}") from error
    return width, height
