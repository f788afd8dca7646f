"""Plots of several drives in one map: the joins, and the drive that the robot was taken to be on."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq_bench.scenarios.report.plots.belief import belief_legend, coarser_note, draw_belief
from refseq_bench.scenarios.report.plots.plan import QUERY_WALLS, FloorOutline, floor_plan
from refseq_bench.scenarios.report.plots.style import (
    DRIVE_COLOURS,
    DRIVE_MARKERS,
    FAULTY,
    TRUTH,
    Plot,
    as_svg,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.report.plots.truth import positions_of
from refseq_bench.scenarios.scoring.atlas import passing
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance, path_of
from refseq_bench.scenarios.scoring.truth import missing_truth

ASIDE = 0.25
"""Distance to the right at which each further drive is drawn [m]; at 0 they hide each other."""
OVER_DRIVES = 1.0
"""Power of the colour: as it is."""


@page_style
def joined_plan(comparison: Comparison, merging: Merging, within: Tolerance, outline: FloorOutline | None) -> Plot:
    """All drives in the plan: filled where they hold their places, hollow where another holds them now.

    A line leads from a view to the place that was taken for its own, where that is farther away than the tolerance.
    """
    path = path_of(comparison)
    drawn = np.concatenate([_aside(path, stretch, number) for number, stretch in enumerate(path.stretches)])
    floor = floor_plan([drawn, positions_of(comparison.query_views)], outline, stretch=False, walls=QUERY_WALLS)
    for number, (name, stretch) in enumerate(zip(merging.names, path.stretches, strict=True)):
        _draw_drive(floor.axes, drawn, stretch, merging, number, name)
    _draw_false(floor.axes, path, drawn, merging, within)
    floor.frame(0.03 * floor.size + 0.5)
    return with_legend(floor.figure)


def _aside(path: ReferencePath, stretch: slice, number: int) -> NDArray[np.float64]:
    right = path.headings[stretch] - math.pi / 2
    shift: NDArray[np.float64] = ASIDE * (number + 1) * np.stack([np.cos(right), np.sin(right)], axis=1)
    return path.points[stretch] + shift


def _draw_drive(
    axes: Axes, drawn: NDArray[np.float64], stretch: slice, merging: Merging, number: int, name: str
) -> None:
    colour, marker = DRIVE_COLOURS[number % len(DRIVE_COLOURS)], DRIVE_MARKERS[number % len(DRIVE_MARKERS)]
    views = np.arange(stretch.start, stretch.stop)
    kept = merging.held_by[views] == views
    axes.plot(*drawn[views].T, color=colour, linewidth=0.6, alpha=0.7)
    look: Mapping[str, Any] = {"color": colour, "markersize": 3, "markeredgewidth": 0.6}
    label = f"{name} ({int(kept.sum())} of {len(kept)})"
    axes.plot(*drawn[views[kept]].T, marker, label=label, **look)
    axes.plot(*drawn[views[~kept]].T, marker, markerfacecolor="none", **look)


def _draw_false(
    axes: Axes, path: ReferencePath, drawn: NDArray[np.float64], merging: Merging, within: Tolerance
) -> None:
    moved = np.flatnonzero(merging.held_by != np.arange(path.size)).tolist()
    false = [v for v in moved if not path.within(path.pose(v), within)[merging.held_by[v]]]
    for number, view in enumerate(false):
        ends = drawn[[view, merging.held_by[view]]]
        label = f"joined with another place ({len(false)})"
        axes.plot(*ends.T, color=FAULTY, linewidth=0.7, linestyle=":", label=None if number else label)


@page_style
def which_drive(comparison: Comparison, methods: Sequence[str], within: Tolerance) -> Plot:
    """P(sequence) over the views, a panel a method and a row a drive; a bar at a row's foot where that drive passes."""
    path = path_of(comparison)
    by = passing(path, path.near(comparison.query_views, within))
    told = not missing_truth(comparison)
    names = [*(comparison.drives.names if comparison.drives else ("",)), "lost"]
    high = 0.35 + 0.16 * len(names)
    figure = new_figure(high * len(methods) + 0.9)
    panels = figure.subplots(len(methods), 1, sharex=True, squeeze=False)[:, 0]
    for axes, method in zip(panels, methods, strict=True):
        if told:
            draw_passing(axes, by)
        found = shares(comparison.beliefs[method], path)
        draw_belief(axes, np.vstack([found, 1 - found.sum(axis=0)]), OVER_DRIVES)
        axes.set_yticks(range(len(names)), names, fontsize=7)
        axes.set(ylim=(len(names) - 0.4, -0.6), title=method_label(method))
        axes.tick_params(axis="y", length=0)
    panels[-1].set(xlabel="query view", xlim=(-0.5, len(by) - 0.5))
    truth = Patch(facecolor=TRUTH, linewidth=0, label="truly there")
    legend = belief_legend("P(sequence)", OVER_DRIVES, *([truth] if told else []))
    return Plot(as_svg(figure), coarser_note(len(names), len(by)), legend)


def shares(beliefs: Sequence[Belief], path: ReferencePath) -> NDArray[np.float64]:
    """Probability of each drive's places, (D, M); the rest of 1 is P(lost)."""
    return np.array([[(1 - b.lost) * b.places[stretch].sum() for b in beliefs] for stretch in path.stretches])


def draw_passing(axes: Axes, by: NDArray[np.bool_]) -> None:
    """A bar at the foot of each drive's row where it passes, and of the last row where none does."""
    for row, there in enumerate(np.column_stack([by, ~by.any(axis=1)]).T):
        ends = np.flatnonzero(np.diff([0, *there.astype(int), 0])).reshape(-1, 2)
        bars = [(first - 0.5, after - first) for first, after in ends.tolist()]
        axes.broken_barh(bars, (row + 0.28, 0.2), facecolor=TRUTH, linewidth=0, zorder=3)
