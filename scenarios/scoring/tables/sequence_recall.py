"""Sequence recall: how many views were answered at places of each path of a map."""

from collections.abc import Mapping, Sequence

import numpy as np

from refseq.belief import LOST_ABOVE, Belief
from refseq.map.map import Map
from refseq_bench.scenarios.tables import TextTable


def answers_by_path(map_: Map, beliefs: Sequence[Belief]) -> dict[str, tuple[int, int]]:
    """For each path, by its name, the views answered at a place that its sequence holds, and at any along it.

    Views that are said to be lost are not counted. Every view has a place that one sequence holds; where paths share
    it, it lies along several of them.
    """
    best = np.array([belief.best for belief in beliefs if belief.lost <= LOST_ABOVE], np.intp)
    holders = np.searchsorted(map_.first, best, side="right") - 1
    held = {name: int((holders == number).sum()) for number, name in enumerate(map_.names)}
    return {path.name: (held.get(path.name, 0), int(np.isin(best, map_.numbered(path)).sum())) for path in map_.paths}


def sequence_recall_table(map_: Map, beliefs: Mapping[str, Sequence[Belief]]) -> TextTable:
    """A row for each path in their order, and one for the views that are said to be lost; a column a method."""
    table = TextTable(
        "path",
        ">places",
        *(f">{method}" for method in beliefs),
        title="views answered at its places / along its path",
        wraps=("path",),
    )
    found = [answers_by_path(map_, answers) for answers in beliefs.values()]
    places = dict(zip(map_.names, map(len, map_.sequences), strict=True))
    for path in map_.paths:
        cells = ["{} / {}".format(*one[path.name]) for one in found]
        table.add_row(path.name, str(places.get(path.name, 0)), *cells)
    lost = [sum(belief.lost > LOST_ABOVE for belief in answers) for answers in beliefs.values()]
    table.add_section()
    table.add_row("says lost", "", *map(str, lost))
    return table
