"""Calibration: observed frequency over stated probability."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from refseq_bench.scenarios.report.plots.style import (
    INK,
    MethodStyle,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.scoring.metrics import Reliability
from refseq_bench.scenarios.scoring.score import Score


@page_style
def reliability(scores: Mapping[str, Score]) -> Plot:
    """Observed frequency over stated probability, around the top place and of being lost."""
    styles = method_styles(scores)
    # P(lost) can be judged only by drives that leave the map.
    leaves = any(score.off_map.any() for score in scores.values())
    figure = new_figure(4.9)
    panels = figure.subplots(2, 2, sharex=True, height_ratios=(3, 1), squeeze=False)
    for column, title in enumerate(("around the top place: is it right?", "P(lost): is it off the map?")):
        shares, counts = panels[:, column]
        if column == 1 and not leaves:
            shares.set_visible(False)
            counts.set_visible(False)
            continue
        shares.plot([0, 1], [0, 1], color=INK, linewidth=0.7, alpha=0.6)
        for method, score in scores.items():
            found = score.lost_reliability if column else score.mass_reliability
            _draw_reliability(shares, counts, found, styles[method], None if column else method_label(method))
        shares.set(title=title, ylabel="share that came true", xlim=(-0.02, 1.02), ylim=(-0.03, 1.03))
        counts.set(xlabel="probability", ylabel="views", ylim=(0, None))
        draw_grid(shares, counts)
    return with_legend(figure)


def _draw_reliability(shares: Axes, counts: Axes, found: Reliability, style: MethodStyle, label: str | None) -> None:
    """A line through the bins that hold views, its markers larger where there are more; below it how many there are."""
    colour, line, marker = style
    there = found.count > 0
    sizes = 6 + 60 * found.count[there] / found.count.sum()
    shares.plot(found.probability[there], found.share[there], color=colour, linestyle=line, linewidth=1, label=label)
    shares.scatter(found.probability[there], found.share[there], sizes, color=colour, marker=marker, linewidths=1)
    edges = np.linspace(0, 1, len(found.count) + 1)
    counts.stairs(found.count, edges, color=colour, linestyle=line, linewidth=1)
