"""How large an atlas is, path by path, and what merging or reducing took out, as a table in Markdown."""

from collections.abc import Mapping, Sequence

import numpy as np

from refseq.atlas.atlas import Atlas, Path
from refseq.map.file import map_bytes
from refseq.map.sequence import ReferenceSequence


def sizes_table(atlas: Atlas, before: Mapping[str, ReferenceSequence]) -> str:
    """Views as they were learnt and places that are left, path by path, and features and bytes of all.

    A map ``before``, by its path's name, may have had more views than the path has: it was reduced.
    """
    known = {name: map_ for name, map_ in before.items() if name in {path.name for path in atlas.paths}}
    learnt = {path.name: len(known.get(path.name, path)) for path in atlas.paths}
    rows = [_row(atlas, path, learnt[path.name]) for path in atlas.paths]
    total, left = sum(learnt.values()), len(atlas)
    if len(rows) > 1:
        rows.append(f"| **all** | {total} | {left} | {total - left} | |")
    head = ["| path | views learnt | places held | taken out | now another path's |", "|---|---:|---:|---:|---|"]
    return "\n".join([*head, *rows, "", *_in_all(atlas, [known.get(path.name) for path in atlas.paths])])


def _row(atlas: Atlas, path: Path, learnt: int) -> str:
    counts = dict(zip(atlas.names, np.bincount(path.sequences, minlength=len(atlas.names)).tolist(), strict=True))
    own = counts.pop(path.name, 0)
    others = ", ".join(f"{name} {count}" for name, count in counts.items() if count) or "–"
    return f"| {path.name} | {learnt} | {own} | {learnt - own} | {others} |"


def _in_all(atlas: Atlas, before: Sequence[ReferenceSequence | None]) -> list[str]:
    """A line each of features and bytes; what they were is known where all maps from before are."""
    whole = [map_ for map_ in before if map_ is not None]
    then = whole if len(whole) == len(before) else []
    features = _change("features", [_features(then)] if then else [], _features(atlas.sequences))
    size = _change("kB of maps", [_kilobytes(then)] if then else [], _kilobytes(atlas.sequences))
    links = [f"- {len(atlas.links)} links from one path to another"] if len(atlas.paths) > 1 else []
    return [f"- {features}", f"- {size}", *links]


def _change(what: str, before: Sequence[int], now: int) -> str:
    return " → ".join(f"{number:,}" for number in (*before, now)) + f" {what}"


def _features(maps: Sequence[ReferenceSequence]) -> int:
    return sum(map_.matrix.N for map_ in maps)


def _kilobytes(maps: Sequence[ReferenceSequence]) -> int:
    return round(sum(len(map_bytes(map_)) for map_ in maps) / 1000)
