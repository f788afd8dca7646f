"""Errors along the reference path: over the true position, and over the entropy of the belief."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.faults import shade_positions
from refseq_bench.scenarios.report.plots.style import (
    RIGHT,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.report.plots.truth import true_along
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance
from refseq_bench.scenarios.scoring.score import Score


@page_style
def errors_along_path(
    comparison: Comparison,
    scores: Mapping[str, Score],
    path: ReferencePath,
    tolerances: Sequence[Tolerance],
    spans: Sequence[FaultSpan] = (),
) -> Plot:
    """Absolute error along the path of every answer given, over the true position."""
    true = np.array([true_along(view.truth, path, tolerances[0]) for view in comparison.query_views])
    figure, axes = _error_figure("true position along the reference path [m]", dict.fromkeys(scores, true), scores)
    _error_axis(axes, scores, tolerances)
    shade_positions(axes, true, spans)
    return with_legend(figure)


@page_style
def errors_over_entropy(comparison: Comparison, scores: Mapping[str, Score], tolerances: Sequence[Tolerance]) -> Plot:
    """Absolute error along the path of every answer given, over the entropy of its belief."""
    entropies = {method: np.array([belief.entropy for belief in comparison.beliefs[method]]) for method in scores}
    figure, axes = _error_figure("entropy of the places [nats]", entropies, scores)
    _error_axis(axes, scores, tolerances)
    axes.set_xlim(left=-0.05)
    return with_legend(figure)


def _error_figure(
    xlabel: str, over: Mapping[str, NDArray[np.float64]], scores: Mapping[str, Score]
) -> tuple[Figure, Axes]:
    """A mark for every answer given: its absolute error, over what is given for each view, (M,), by method."""
    figure = new_figure(3.4)
    axes = figure.add_subplot(xlabel=xlabel, ylabel="error along the path [m]")
    for method, (colour, _, marker) in method_styles(scores).items():
        errors, label = np.abs(scores[method].errors), method_label(method)
        axes.plot(over[method], errors, marker, color=colour, markersize=4, markerfacecolor="none", label=label)
    return figure, axes


def _error_axis(axes: Axes, scores: Mapping[str, Score], tolerances: Sequence[Tolerance]) -> None:
    """Errors upwards, linear up to 1 m and logarithmic above, the tolerances shaded."""
    axes.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    top = max(2.0, *(np.nanmax(np.abs(s.errors), initial=0.0) for s in scores.values())) * 1.2
    ticks = [t for t in (0, 0.5, 1.5, 5, 10, 20, 50, 100, 200, 500) if t <= top]
    axes.set(ylim=(-0.05, top), yticks=ticks, yticklabels=[f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    for tolerance in tolerances:
        axes.axhspan(0, tolerance.distance, color=RIGHT, alpha=0.12, linewidth=0)
    draw_grid(axes)
