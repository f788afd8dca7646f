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


@dataclass(frozen=True, slots=True)
class Sweep:
    """Shares over a key that several cases vary: the key, its values in words, and where they stand on its axis.

    ``at`` is None for values that are no numbers: they stand side by side. ``shares`` holds for each method a row
    (value, low, high) a case, in [0, 1], nan where there is none. Values are in the order of the axis.
    """

    key: str
    values: Sequence[str]
    at: Sequence[float] | None
    shares: Mapping[str, NDArray[np.float64]]


@page_style
def success_over(sweep: Sweep) -> Plot:
    """Success over what is varied, with 95 % intervals, a line a method."""
    at = np.arange(len(sweep.values), dtype=float) if sweep.at is None else np.array(sweep.at, dtype=float)
    spread = 0.012 * max(float(np.ptp(at)), 1e-9)
    figure = new_figure(4.2)
    axes = figure.add_subplot(xlabel=sweep.key, ylabel="success [%]", ylim=(-3, 103))
    for number, (method, (colour, line, marker)) in enumerate(method_styles(sweep.shares).items()):
        # Side by side, or the intervals of equal shares would hide one another.
        there = at + spread * (number - (len(sweep.shares) - 1) / 2)
        style = colour, "none" if sweep.at is None else line, marker
        draw_shares(axes, there, sweep.shares[method], style, method_label(method))
    axes.set_xticks(at, _staggered(at, sweep.values), rotation=0 if len(sweep.values) <= 8 else 30)
    draw_grid(axes)
    return with_legend(figure)


def _staggered(at: NDArray[np.float64], labels: Sequence[str]) -> list[str]:
    """Labels of ticks; one that would run into the label before it is written a line lower."""
    wide = float(np.ptp(at)) / CHARACTERS
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
