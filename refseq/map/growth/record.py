"""Record of the drives that a map has grown by, so that none is added twice."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from refseq.limits import MAP_PLACES
from refseq.map.merge_record import sha256_of
from refseq.view import View


@dataclass(frozen=True, slots=True)
class AddedDrive:
    """A drive that was added: its ``name``, the SHA-256 of its ``views``, and how many were kept as experiences."""

    name: str
    sha256: str
    views: int
    kept: int


@dataclass(frozen=True, slots=True)
class GrowthRecord:
    """Drives that were added to a map, the first one first."""

    drives: tuple[AddedDrive, ...] = ()

    def drive(self, sha256: str) -> AddedDrive | None:
        """The drive of such views, if it was added."""
        return next((one for one in self.drives if one.sha256 == sha256), None)

    @classmethod
    def joined(cls, records: "Iterable[GrowthRecord]") -> Self:
        """The record of several maps as one: each drive once, the first to name it first."""
        drives: dict[str, AddedDrive] = {}
        for record in records:
            for drive in record.drives:
                drives.setdefault(drive.sha256, drive)
        return cls(tuple(drives.values()))

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words, for a map's header."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: object) -> Self:
        """The inverse of ``to_dict``; ``ValueError`` in one line for what is none."""
        drives = content.get("drives") if isinstance(content, Mapping) and set(content) == {"drives"} else None
        if not isinstance(drives, list) or not all(isinstance(table, Mapping) for table in drives):
            raise ValueError("grown is no table of drives")
        return cls(tuple(map(_drive, drives)))


def _drive(table: Mapping[str, Any]) -> AddedDrive:
    name = table.get("name")
    if not isinstance(name, str):
        raise ValueError(f"grown.drives: name is {name!r:.80}; valid is a text")
    return AddedDrive(name, sha256_of(table, "grown.drives"), _count(table, "views"), _count(table, "kept"))


def _count(table: Mapping[str, Any], key: str) -> int:
    count = table.get(key)
    if type(count) is not int or not 0 <= count <= MAP_PLACES:
        raise ValueError(f"grown.drives: {key} is {count!r:.80}; valid is 0 to {MAP_PLACES}")
    return count


def digest_of(views: Iterable[View]) -> str:
    """SHA-256 of what views show and of the way between them, whatever file they come from."""
    digest = hashlib.sha256()
    for view in views:
        digest.update(np.array([view.distance, view.turn]).tobytes())
        for name, image in sorted(view.images.items()):
            digest.update(f"{name} {image.shape} {image.dtype};".encode())
            digest.update(np.ascontiguousarray(image).tobytes())
        if view.scan is not None:
            digest.update(np.asarray(view.scan.ranges, np.float32).tobytes())
    return digest.hexdigest()


NOT_GROWN = GrowthRecord()
"""The record of a map that no drive was added to."""
