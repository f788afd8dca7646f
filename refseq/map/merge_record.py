"""Record of a merging in its map: which maps were merged, and what a person decided, so that it can be decided anew."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

DIGITS = frozenset("0123456789abcdef")


@dataclass(frozen=True, slots=True)
class Member:
    """A map that was merged into another: its ``file`` as seen from the folder of that other, and its SHA-256."""

    file: str
    sha256: str


@dataclass(frozen=True, slots=True)
class Ruling:
    """A person's word on a join: stretches of two paths, first and last view, and whether they are one."""

    one: str
    other: str
    first: tuple[int, int]
    second: tuple[int, int]
    joined: bool


@dataclass(frozen=True, slots=True)
class MergeRecord:
    """Maps that were merged, and a person's decisions about them; both empty for a map that was not merged.

    ``min_overlap`` [m] is the shortest stretch to be joined by itself that a person asked for, None for the usual.
    """

    members: tuple[Member, ...] = ()
    rulings: tuple[Ruling, ...] = ()
    min_overlap: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words, for a map's header; without ``min_overlap`` where nobody asked for one."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    @classmethod
    def from_dict(cls, content: object) -> Self:
        """The inverse of ``to_dict``; ``ValueError`` in one line for what is none."""
        if not isinstance(content, Mapping) or set(content) - {"min_overlap"} != {"members", "rulings"}:
            raise ValueError("merged is no table of members and rulings")
        tables = {name: content[name] for name in ("members", "rulings")}
        for name, every in tables.items():
            if not isinstance(every, list) or not all(isinstance(table, Mapping) for table in every):
                raise ValueError(f"merged.{name} is no list of tables")
        members, rulings = tuple(map(_member, tables["members"])), tuple(map(_ruling, tables["rulings"]))
        return cls(members, rulings, _metres(content["min_overlap"]) if "min_overlap" in content else None)


def _member(table: Mapping[str, Any]) -> Member:
    file = table.get("file")
    if not isinstance(file, str) or not file or "\0" in file:
        raise ValueError(f"merged.members: file is {file!r:.80}; valid is a name")
    return Member(file, sha256_of(table, "merged.members"))


def sha256_of(table: Mapping[str, Any], where: str) -> str:
    """Return the SHA-256 of a record's table; raises ``ValueError`` that says ``where`` for anything else."""
    digest = table.get("sha256")
    if not isinstance(digest, str) or len(digest) != 64 or not DIGITS.issuperset(digest):
        raise ValueError(f"{where}: sha256 is {digest!r:.80}; valid are 64 hexadecimal digits")
    return digest


def _ruling(table: Mapping[str, Any]) -> Ruling:
    one, other, joined = (table.get(name) for name in ("one", "other", "joined"))
    if not isinstance(one, str) or not isinstance(other, str) or not isinstance(joined, bool):
        raise ValueError("merged.rulings: one is not about two paths by name, joined or not")
    return Ruling(one, other, _stretch(table.get("first")), _stretch(table.get("second")), joined)


def _metres(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value < math.inf:
        raise ValueError(f"merged.min_overlap is {value!r:.80}; valid are metres, 0 or more")
    return float(value)


def _stretch(views: object) -> tuple[int, int]:
    if not isinstance(views, list) or len(views) != 2 or not all(type(view) is int for view in views):
        raise ValueError(f"merged.rulings: {views!r:.80} is no stretch; valid are first and last view")
    first, last = views
    if not 0 <= first <= last:
        raise ValueError(f"merged.rulings: {views!r:.80} is no stretch; valid are first and last view")
    return first, last


NOT_MERGED = MergeRecord()
"""The record of a map that was learnt."""
