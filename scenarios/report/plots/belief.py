"""Beliefs over places as heat maps, a column a view and a panel a method."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, PowerNorm, to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq_bench.scenarios.report.plots.faults import mark_ends
from refseq_bench.scenarios.report.plots.style import (
    BELIEF,
    FAULTY,
    INK,
    TRUTH,
    LegendEntry,
    Plot,
    as_svg,
    legend_entry,
    new_figure,
    page_style,
)
from refseq_bench.scenarios.report.plots.truth import draw_truth
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives, method_label
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance

PANELS = 3
"""Heat maps side by side; of several drives, which hold more places, one less."""
FINEST = 200, 320
"""Rows and columns that a heat map has at most: more would be finer than what a screen shows."""
SWATCHES = (0.01, 0.1, 0.5, 1.0)
"""Probabilities that a legend shows, as far as they can be seen."""
LAST_SURE: Mapping[str, Any] = {"marker": "x", "markersize": 4, "linestyle": "none"}
"""Mark at the place where a localiser that says lost was last sure."""
OVER_PLACES = 0.5
"""Power of the colour: the square root, or a belief over hundreds of places could not be seen."""


@page_style
def belief_heatmaps(
    comparison: Comparison, path: ReferencePath | None, wide: Tolerance, spans: Sequence[FaultSpan] = ()
) -> Plot:
    """Probability of every place at every view, one panel a method, over the band of right answers."""
    methods, places = list(comparison.beliefs), len(comparison.reference_views)
    columns = min(PANELS - (len(comparison.stretches) > 1), len(methods))
    rows = math.ceil(len(methods) / columns)
    figure = new_figure(rows * 11 / max(columns, 2) + 0.6)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, method in itertools.zip_longest(panels.flat, methods):
        if method is None:
            axes.set_visible(False)
            continue
        if path is not None:
            draw_truth(axes, comparison.query_views, path, wide, [one.first for one in spans if one.carried])
        _draw_beliefs(axes, comparison.beliefs[method], places)
        for span in spans:
            mark_ends(axes, span)
        axes.set(title=method_label(method), xlim=(-1, len(comparison.query_views)), ylim=(-1, places * 1.05))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _label_axes(panels, len(methods))
    if comparison.drives is not None and len(comparison.stretches) > 1:
        _mark_drives(panels, comparison.drives)
    right = Patch(facecolor=TRUTH, alpha=0.35, edgecolor=TRUTH, linewidth=0.7, label="right answers")
    says_lost = Line2D([], [], color=INK, marker="v", markersize=4, linestyle="none", label="says lost")
    told = any(belief.last_sure is not None for beliefs in comparison.beliefs.values() for belief in beliefs)
    last_sure = Line2D([], [], color=FAULTY, label="lost: last sure here", **LAST_SURE)
    marks = [*([right] if path else []), says_lost, *([last_sure] if told else [])]
    legend = belief_legend("P(place | on the path)", OVER_PLACES, *marks)
    return Plot(as_svg(figure), coarser_note(places, len(comparison.query_views)), legend)


def _label_axes(panels: NDArray[Any], count: int) -> None:
    """Name the axes; where the last row is not full, the numbers stand below the panel above its gap."""
    columns = panels.shape[1]
    for column in range(columns):
        lowest = panels[(count - 1 - column) // columns, column]
        lowest.set_xlabel("query view")
        lowest.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel("reference place")


def _mark_drives(panels: NDArray[Any], drives: Drives) -> None:
    """Draw a line between the places of one drive and of the next; their names stand in place of numbers."""
    for axes in panels.flat:
        for stretch in drives.stretches[1:]:
            axes.axhline(stretch.start - 0.5, color=INK, alpha=0.35, linewidth=0.6)
    for axes in panels[:, 0]:
        middles = [(stretch.start + stretch.stop - 1) / 2 for stretch in drives.stretches]
        axes.set_yticks(middles, drives.names, fontsize=8)
        axes.tick_params(axis="y", length=0)
        axes.set_ylabel("places of each drive, in their order")


def _draw_beliefs(axes: Axes, beliefs: Sequence[Belief], places: int) -> None:
    draw_belief(axes, np.stack([belief.places for belief in beliefs], axis=1), OVER_PLACES)
    lost = [t for t, belief in enumerate(beliefs) if belief.lost > LOST_ABOVE]
    axes.plot(lost, [places * 1.025] * len(lost), "v", color=INK, markersize=3.5, markeredgewidth=0)
    sure = [(t, belief.last_sure) for t, belief in enumerate(beliefs) if belief.last_sure is not None]
    axes.plot(*zip(*sure, strict=True) if sure else ((), ()), color=FAULTY, **LAST_SURE)


def draw_belief(axes: Axes, shares: NDArray[np.float64], power: float) -> None:
    """Probabilities, (rows, views), as a colour as opaque as a ``power`` of them: what lies below shows through."""
    colours = ListedColormap([(*to_rgb(BELIEF), opacity) for opacity in np.linspace(0, 1, 256)])
    coarse = coarser(shares)
    each = np.ceil(np.array(shares.shape) / FINEST).clip(1)
    height, width = np.array(coarse.shape) * each
    axes.imshow(
        coarse, norm=PowerNorm(power, 0, 1), cmap=colours, origin="lower", aspect="auto", interpolation="none",
        extent=(-0.5, width - 0.5, -0.5, height - 0.5), zorder=2,
    )  # fmt: skip


def coarser(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """The highest of as many neighbours as it takes to have no more than ``FINEST`` rows and columns."""
    for axis, finest in enumerate(FINEST):
        each = max(1, math.ceil(shares.shape[axis] / finest))
        shares = np.maximum.reduceat(shares, range(0, shares.shape[axis], each), axis=axis)
    return shares


def coarser_note(places: int, views: int) -> str:
    """A note for the reader where a heat map is coarser than its data."""
    each = [math.ceil(count / finest) for count, finest in zip((places, views), FINEST, strict=True)]
    told = [f"{n} {what}" for n, what in zip(each, ("places", "views"), strict=True) if n > 1]
    return f"Each cell is the highest of {' and '.join(told)}." if told else ""


def belief_legend(shown: str, power: float, *more: Artist) -> tuple[LegendEntry, ...]:
    """A legend of probabilities, by what is ``shown``, and of whatever more there is."""
    handles = [
        Patch(facecolor=BELIEF, alpha=share**power, linewidth=0, label=f"{'' if n else shown + ' = '}{share:g}")
        for n, share in enumerate(share for share in SWATCHES if share**power > 0.05)
    ]
    return tuple(legend_entry(one, str(one.get_label())) for one in (*handles, *more))
