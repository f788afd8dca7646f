"""Precision over recall of each method's answers."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from refseq_bench.scenarios.report.plots.style import (
    MethodStyle,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.scoring.metrics import Retrieval
from refseq_bench.scenarios.scoring.score import Score


@page_style
def precision_recall(scores: Mapping[str, Score]) -> Plot:
    """Precision over recall of each method's answers, from the surest on."""
    figure = new_figure(4.4)
    axes = figure.add_subplot(xlabel="recall", ylabel="precision", xlim=(-0.01, 1.01), ylim=(0, 1.03))
    for method, style in method_styles(scores).items():
        if curve := scores[method].retrieval:
            draw_retrieval(axes, curve, style, method_label(method))
    draw_grid(axes)
    return with_legend(figure)


def draw_retrieval(axes: Axes, curve: Retrieval, style: MethodStyle, label: str) -> None:
    """The curve as steps, so that what lies under them is its area; a mark where all answers are taken."""
    colour, line, marker = style
    recall, precision = np.concatenate([[0.0], curve.recall]), np.concatenate([curve.precision[:1], curve.precision])
    named = f"{label} (AUC {curve.auc:.3f})"
    axes.step(recall, precision, where="pre", color=colour, linestyle=line, linewidth=1.3, label=named)
    axes.plot(recall[-1:], precision[-1:], marker, color=colour, markersize=6)
