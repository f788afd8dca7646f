"""Heat maps of beliefs, read back from their SVG: where it says lost, the place at which it was last sure is marked."""

import re
from dataclasses import replace

import numpy as np

from refseq.belief import Belief
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.report.plots.belief import belief_heatmaps
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.path_geometry import WIDE

PLACES, LEFT_AT = 8, 5
"""Places of the map, and the one behind which the robot leaves it."""
SAID = "lost: last sure here"


def heat_map(beliefs: list[Belief]) -> Plot:
    views = [View(float(k), truth=Pose(float(k), 0.0, 0.0)) for k in range(PLACES)]
    return belief_heatmaps(Comparison("test", views, {}, views, {}, {"best/chain": beliefs}), None, WIDE)


def beliefs(lost_after: np.ndarray | None) -> list[Belief]:
    """Surely at each place in turn, and lost from the sixth view on."""
    found = [Belief(row, 0.0, k, (k,), 0.0, lost_after=np.zeros(PLACES)) for k, row in enumerate(np.eye(PLACES))]
    return [one if k <= LEFT_AT else replace(one, lost=0.9, lost_after=lost_after) for k, one in enumerate(found)]


def crosses(plot: Plot) -> list[tuple[float, float]]:
    """Markers of lines that are drawn as crosses, in points of the figure."""
    kinds = dict(re.findall(r'<path id="(\w+)" d="([^"]*)"', plot.svg))
    uses = re.findall(r'<use xlink:href="#(\w+)" x="([\d.]+)" y="([\d.]+)"', plot.svg)
    return [
        (float(x), float(y)) for kind, x, y in uses if kinds.get(kind, "").count("M") == 2 and "C" not in kinds[kind]
    ]


def test_a_cross_stands_where_it_was_last_sure_at_each_view_at_which_it_says_lost() -> None:
    after = np.zeros(PLACES)
    after[LEFT_AT] = 0.8
    told = heat_map(beliefs(after))
    assert SAID in [entry.label for entry in told.legend]
    at = crosses(told)
    assert len(at) == PLACES - LEFT_AT - 1
    assert len({y for _, y in at}) == 1
    after = np.roll(after, -3)
    (lower,) = {y for _, y in crosses(heat_map(beliefs(after)))}
    assert lower > at[0][1]  # of a place nearer to the begin; SVG counts downwards


def test_none_stands_where_nobody_tells_where_it_was_last_sure() -> None:
    for nothing in (None, np.zeros(PLACES)):
        silent = heat_map(beliefs(nothing))
        assert SAID not in [entry.label for entry in silent.legend]
        assert crosses(silent) == []
