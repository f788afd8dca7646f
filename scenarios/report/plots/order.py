"""Scores of methods on real sets over those on simulated twins: where points rise to the right, the orders agree."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.style import (
    INK,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)

COLUMNS = 3
"""Panels beside each other."""
HEIGHT = 3.3
"""Of a row of panels [inch]."""


@dataclass(frozen=True, slots=True)
class OrderPanel:
    """Scores of methods, (M,) each, in [0, 1]."""

    name: str
    twin: NDArray[np.float64]
    real: NDArray[np.float64]


@page_style
def real_over_twin(panels: Sequence[OrderPanel], methods: Sequence[str], figure: str) -> Plot:
    """A panel for each set, a marker a method."""
    rows = math.ceil(len(panels) / COLUMNS)
    drawing = new_figure(HEIGHT * rows)
    grid = drawing.subplots(rows, COLUMNS, squeeze=False)
    styles = method_styles(methods)
    for axes, panel in zip(grid.flat, panels, strict=False):
        axes.set(title=panel.name, xlim=(-4, 104), ylim=(-4, 104), aspect="equal")
        axes.plot([0, 100], [0, 100], color=INK, alpha=0.3, linewidth=0.8)
        for method, twin, real in zip(methods, 100 * panel.twin, 100 * panel.real, strict=True):
            colour, _, marker = styles[method]
            label = method if panel is panels[0] else "_"
            axes.plot(twin, real, marker, color=colour, markersize=7, markeredgewidth=1.6, alpha=0.8, label=label)
        draw_grid(axes)
    for axes in list(grid.flat)[len(panels) :]:
        axes.set_axis_off()
    drawing.supxlabel(f"{figure} on the simulated twin [%]")
    drawing.supylabel(f"{figure} on the real set [%]")
    return with_legend(drawing)
