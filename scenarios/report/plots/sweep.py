"""Success over the one key that the cases of a scenario vary."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

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

CHARACTERS = 100
"""About how many fit side by side along the axis of a plot as wide as the page."""
COLUMNS, HEIGHT = 2, 2.9
"""Panels beside each other where several sweeps share a figure, and the height of a row of them [inch]."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """Shares over a key that several cases vary: the key, its values in words, and where they stand on its axis.

    ``at`` is None for values that are no numbers: they stand side by side. ``shares`` holds for each method a row
    (value, low, high) a case, in [0, 1], nan where there is none. Values are in the order of the axis.
    """

    title: str
    key: str
    values: Sequence[str]
    at: Sequence[float] | None
    shares: Mapping[str, NDArray[np.float64]]


@page_style
def success_over(sweep: Sweep) -> Plot:
    """Success over what is varied, with 95 % intervals, a line a method."""
    figure = new_figure(4.2)
    _draw_sweep(figure.add_subplot(ylabel="success [%]"), sweep, method_styles(sweep.shares), CHARACTERS)
    return with_legend(figure)


@page_style
def success_over_each(sweeps: Sequence[Sweep]) -> Plot:
    """The same for several sweeps, a panel each; a method looks alike in all of them."""
    columns = min(COLUMNS, len(sweeps))
    rows = math.ceil(len(sweeps) / columns)
    figure = new_figure(HEIGHT * rows)
    grid = figure.subplots(rows, columns, squeeze=False)
    styles = method_styles(dict.fromkeys(method for sweep in sweeps for method in sweep.shares))
    for axes, sweep in zip(grid.flat, sweeps, strict=False):
        axes.set_title(sweep.title)
        _draw_sweep(axes, sweep, styles, CHARACTERS / columns)
    for axes in list(grid.flat)[len(sweeps) :]:
        axes.set_axis_off()
    figure.supylabel("success [%]")
    return with_legend(figure)


def _draw_sweep(axes: Axes, sweep: Sweep, styles: Mapping[str, MethodStyle], characters: float) -> None:
    """One sweep, in the methods' styles; so many characters fit along the axis."""
    at = np.arange(len(sweep.values), dtype=float) if sweep.at is None else np.array(sweep.at, dtype=float)
    spread = 0.012 * max(float(np.ptp(at)), 1e-9)
    named = axes.figure.axes[0] is axes  # a legend names each method once
    for number, (method, shares) in enumerate(sweep.shares.items()):
        # Side by side, or the intervals of equal shares would hide one another.
        there = at + spread * (number - (len(sweep.shares) - 1) / 2)
        colour, line, marker = styles[method]
        style = colour, "none" if sweep.at is None else line, marker
        draw_shares(axes, there, shares, style, method_label(method) if named else "_")
    axes.set_xticks(at, _staggered(at, sweep.values, characters), rotation=0 if len(sweep.values) <= 8 else 30)
    axes.set(xlabel=sweep.key, ylim=(-3, 103))
    draw_grid(axes)


def _staggered(at: NDArray[np.float64], labels: Sequence[str], characters: float) -> list[str]:
    """Labels of ticks; one that would run into the label before it is written a line lower."""
    wide = float(np.ptp(at)) / characters
    told, end = [], -math.inf
    for place, label in zip(at, labels, strict=True):
        half = wide * (len(label) + 1) / 2
        runs_in = place - half < end
        told.append(f"\n{label}" if runs_in else label)
        end = end if runs_in else place + half
    return told


def draw_shares(
    axes: Axes, at: NDArray[np.float64], shares: NDArray[np.float64], style: MethodStyle, label: str
) -> None:
    """One method's shares [%] with their intervals; ``shares`` holds rows (value, low, high)."""
    colour, line, marker = style
    value, low, high = 100 * shares.T
    bars = np.nan_to_num(np.clip([value - low, high - value], 0, None))
    axes.errorbar(
        at, value, bars, color=colour, marker=marker, markersize=5, linewidth=1.3, elinewidth=0.8, capsize=2,
        linestyle=line, label=label,
    )  # fmt: skip
