"""The header of a map file: the profile, and a table for each sequence and each path, checked as they are read."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from refseq.limits import MAP_FEATURES
from refseq.map.extractors import check_feature
from refseq.map.growth.record import NOT_GROWN, GrowthRecord
from refseq.map.merge_record import NOT_MERGED, MergeRecord
from refseq.map.paths.annotations import Annotations
from refseq.map.profile import Profile


@dataclass(frozen=True, slots=True)
class SequenceTable:
    """A sequence's ``name``, the number of features of each extractor (``blocks``), and its drive's ``metadata``."""

    name: str
    blocks: Mapping[str, int]
    metadata: Mapping[str, str]

    @property
    def features(self) -> int:
        """Number of features in all."""
        return sum(self.blocks.values())


@dataclass(frozen=True, slots=True)
class PathTable:
    """A path's ``name`` and ``annotations``."""

    name: str
    annotations: Annotations


@dataclass(frozen=True, slots=True)
class MapHeader:
    """All that a map file holds beside its arrays; names are there once."""

    profile: Profile
    sequences: tuple[SequenceTable, ...]
    paths: tuple[PathTable, ...]
    merged: MergeRecord = NOT_MERGED
    grown: GrowthRecord = NOT_GROWN


def parse_header(content: Mapping[str, Any]) -> MapHeader:
    """A header from a file's JSON. Raises ``ValueError`` or ``MapError`` in one line, ``KeyError`` for what lacks."""
    if not isinstance(content["profile"], dict):
        raise ValueError("profile is no table")
    return MapHeader(
        Profile.from_dict(content["profile"]),
        tuple(map(_sequence, _tables(content, "sequences"))),
        tuple(map(_path, _tables(content, "paths"))),
        MergeRecord.from_dict(content["merged"]) if "merged" in content else NOT_MERGED,
        GrowthRecord.from_dict(content["grown"]) if "grown" in content else NOT_GROWN,
    )


def _tables(content: Mapping[str, Any], what: str) -> list[dict[str, Any]]:
    tables = content[what]
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise ValueError(f"{what} is no list of tables, at least one")
    names = set()
    for name in (table["name"] for table in tables):
        if not isinstance(name, str):
            raise ValueError(f"{what}: a name is no text")
        if name in names:
            raise ValueError(f"{what}: name {name!r:.80} is there twice")
        names.add(name)
    return tables


def _sequence(table: Mapping[str, Any]) -> SequenceTable:
    for name in ("blocks", "metadata"):
        if not isinstance(table[name], dict):
            raise ValueError(f"{name} is no table")
    for key, size in table["blocks"].items():
        check_feature(key)
        if type(size) is not int or not 0 <= size <= MAP_FEATURES:
            raise ValueError(f"blocks: {key!r:.80} has {size!r:.80} features; valid are 0 to {MAP_FEATURES}")
    for key, value in table["metadata"].items():
        if not isinstance(value, str):
            raise ValueError(f"metadata: {key!r:.80} is {value!r:.80}; valid is a text")
    return SequenceTable(table["name"], table["blocks"], MappingProxyType(table["metadata"]))


def _path(table: Mapping[str, Any]) -> PathTable:
    return PathTable(table["name"], Annotations.from_dict(table["annotations"]))
