"""Sizes of a map path by path, and the views that merging or reducing took out, as a table in Markdown."""

from collections.abc import Mapping, Sequence

import numpy as np

from refseq.map.map import Map
from refseq.map.paths.path import MapPath


def sizes_table(map_: Map, before: Mapping[str, Map]) -> str:
    """Views as they were learnt and places that are left, path by path, and features and bytes of all.

    A map ``before``, by its path's name, may have had more views than the path has: it was reduced.
    """
    known = {name: one for name, one in before.items() if name in {path.name for path in map_.paths}}
    learnt = {path.name: len(known.get(path.name, path)) for path in map_.paths}
    rows = [_row(map_, path, learnt[path.name]) for path in map_.paths]
    total, left = sum(learnt.values()), len(map_)
    if len(rows) > 1:
        rows.append(f"| **all** | {total} | {left} | {total - left} | |")
    head = ["| path | views learnt | places held | taken out | held by |", "|---|---:|---:|---:|---|"]
    return "\n".join([*head, *rows, "", *_in_all(map_, [known.get(path.name) for path in map_.paths])])


def _row(map_: Map, path: MapPath, learnt: int) -> str:
    counts = dict(zip(map_.names, np.bincount(path.sequences, minlength=len(map_.names)).tolist(), strict=True))
    own = counts.pop(path.name, 0)
    others = ", ".join(f"{name} {count}" for name, count in counts.items() if count) or "–"
    return f"| {path.name} | {learnt} | {own} | {learnt - own} | {others} |"


def _in_all(map_: Map, before: Sequence[Map | None]) -> list[str]:
    """A line each of features and bytes; what they were is known where all maps from before are."""
    whole = [one for one in before if one is not None]
    then = whole if len(whole) == len(before) else []
    features = _change("features", [_features(then)] if then else [], _features([map_]))
    size = _change("kB of maps", [_kilobytes(then)] if then else [], _kilobytes([map_]))
    count = len(map_.links)
    links = [f"- {count} link{'s' * (count != 1)} from one path to another"] if len(map_.paths) > 1 else []
    return [f"- {features}", f"- {size}", *links]


def _change(what: str, before: Sequence[int], now: int) -> str:
    return " → ".join(f"{number:,}" for number in (*before, now)) + f" {what}"


def _features(maps: Sequence[Map]) -> int:
    return sum(sequence.matrix.N for one in maps for sequence in one.sequences)


def _kilobytes(maps: Sequence[Map]) -> int:
    return round(sum(len(one.to_bytes()) for one in maps) / 1000)
