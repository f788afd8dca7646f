"""Confidence of a localiser over a drive: probability of being lost, entropy of the places, sensors declared ill."""

import math
from collections.abc import Sequence

from matplotlib.axes import Axes

from refseq.belief import LOST_ABOVE
from refseq.fault import DeclaredFault, declared_in
from refseq.view import View
from refseq_bench.scenarios.report.plots.faults import shade_views
from refseq_bench.scenarios.report.plots.style import (
    FAULTY,
    INK,
    RIGHT,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance

BAND = 0.3
"""Height of a sensor's band [inch]."""


@page_style
def confidence(
    comparison: Comparison, path: ReferencePath | None, wide: Tolerance, spans: Sequence[FaultSpan] = ()
) -> Plot:
    """Probability of being lost, and entropy of the places, over the views; below a band for each ill sensor."""
    declared = declared_faults(comparison)
    ill = sorted({fault.sensor for faults in declared for fault in faults})
    figure = new_figure(4.2 + BAND * bool(ill) + BAND * len(ill))
    shares = [2.0, 2.0, *[BAND * (len(ill) + 0.5)] * bool(ill)]
    top, bottom, *bands = figure.subplots(len(shares), 1, sharex=True, height_ratios=shares)
    for method, (colour, line, _) in method_styles(comparison.beliefs).items():
        style = {"color": colour, "linestyle": line, "linewidth": 1.3}
        beliefs = comparison.beliefs[method]
        top.plot([belief.lost for belief in beliefs], label=method_label(method), **style)
        bottom.plot([belief.entropy for belief in beliefs], **style)
    ignorance = math.log(len(comparison.reference_views))
    _threshold(top, LOST_ABOVE, "above: says lost")
    _threshold(bottom, ignorance, "knows nothing (ln K)")
    if path is not None:
        _shade_off_map(top, comparison.query_views, path, wide)
    shade_views(top, spans)
    shade_views(bottom, spans, labelled=False)
    top.set(ylabel="P(lost)", ylim=(-0.03, 1.03))
    bottom.set(ylabel="entropy [nats]", xlim=(-1, len(comparison.query_views)))
    figure.axes[-1].set_xlabel("query view")
    bottom.set_ylim(0, 1.15 * max(1.0, ignorance))
    draw_grid(top, bottom)
    for axes in bands:
        _draw_bands(axes, declared, ill)
    return with_legend(figure)


def declared_faults(comparison: Comparison) -> list[tuple[DeclaredFault, ...]]:
    """Faults that stood at each view, by the first method that tells any: sensors are judged once for all stages."""
    told = ([belief.faults for belief in beliefs] for beliefs in comparison.beliefs.values())
    return next((faults for faults in told if any(faults)), [()] * len(comparison.query_views))


def _draw_bands(axes: Axes, declared: Sequence[Sequence[DeclaredFault]], ill: Sequence[str]) -> None:
    """A bar for each fault over the views at which it stood, in its sensor's row, with its kind beside it."""
    for fault in declared_in(declared):
        stood = [view for view, faults in enumerate(declared) if fault in faults]
        row, left = ill.index(fault.sensor), stood[0] - 0.5
        axes.barh(row, stood[-1] + 0.5 - left, 0.7, left, color=FAULTY, alpha=0.45, linewidth=0)
        axes.annotate(fault.kind, (left, row), (3, 0), textcoords="offset points", va="center", fontsize=8)
    axes.set(yticks=range(len(ill)), yticklabels=ill, ylim=(len(ill) - 0.5, -0.5))


def _threshold(axes: Axes, height: float, text: str) -> None:
    axes.axhline(height, color=INK, linewidth=0.7, alpha=0.6)
    axes.annotate(
        text, (1, height), (-2, 2), ("axes fraction", "data"), "offset points", ha="right", va="bottom", fontsize=8
    )


def _shade_off_map(axes: Axes, views: Sequence[View], path: ReferencePath, wide: Tolerance) -> None:
    off = [t for t, view in enumerate(views) if view.truth is not None and not path.within(view.truth, wide).any()]
    for number, t in enumerate(off):
        label = None if number else "off the map"
        axes.axvspan(t - 0.5, t + 0.5, color=RIGHT, alpha=0.25, linewidth=0, label=label)
