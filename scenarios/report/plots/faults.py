"""Faults of a drive in its plots: lines where they begin and end, and hatched spans."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.style import INK
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan

HATCHES = ("////", "....", "xxxx", "----")
"""Hatches tell faults apart: colour is left to the methods."""


def mark_ends(axes: Axes, span: FaultSpan) -> None:
    """Draw a line where a fault begins, and one where it ends."""
    for at in (span.first - 0.5, *(() if span.carried else (span.last + 0.5,))):
        axes.axvline(at, color=INK, alpha=0.6, linewidth=0.8, linestyle="--", zorder=3)


def shade_views(axes: Axes, spans: Sequence[FaultSpan], *, labelled: bool = True) -> None:
    """Faults over the query's views: a hatched stretch, or a line where the robot was carried away."""
    for number, span in enumerate(spans):
        stretch = span.first - 0.5, span.last + 0.5
        _shade(axes, span, number, stretch, span.label if labelled else None)


def _shade(axes: Axes, span: FaultSpan, number: int, stretch: tuple[float, float], label: str | None) -> None:
    if span.carried:
        axes.axvline(stretch[0], color=INK, linewidth=1.2, linestyle=":", label=label)
    else:
        hatch = HATCHES[number % len(HATCHES)]
        axes.axvspan(*stretch, hatch=hatch, facecolor="none", edgecolor=INK, alpha=0.3, linewidth=0, label=label)


def shade_positions(axes: Axes, true: NDArray[np.float64], spans: Sequence[FaultSpan]) -> None:
    """Shade the query's faults along the reference path, as far as it was on the map there."""
    for number, span in enumerate(spans):
        there = true[span.first : span.last + 1]
        if np.isfinite(there).any():
            _shade(axes, span, number, (np.nanmin(there), np.nanmax(there)), span.label)
