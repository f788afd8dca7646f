"""Plots of several drives in one atlas: what was joined, and which of them the robot was taken to be on."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq.belief import Belief
from scenarios.atlas_score import passing
from scenarios.comparison import Comparison, method_label
from scenarios.merging import Merging
from scenarios.plots import INK, FloorOutline, Plot, around, as_svg, draw_walls, page_look, positions_of
from scenarios.score import ReferencePath, Tolerance, path_of

COLOURS = ("#2a8fd4", "#d55e00", "#2a9d6f", "#d6409f", "#b8860b", "#5b5bd6", "#4fb3bf", "#8c564b")
"""Of drives, one after the other; when they are used up they come again, hatched."""
HATCHES = ("", "///", "...", "xxx")
ASIDE = 0.25
"""How far to the right of its way each further drive is drawn [m], or they would hide each other."""
FAR_OFF = "#9b1d20"


def joined_plan(comparison: Comparison, merging: Merging, within: Tolerance, outline: FloorOutline | None) -> Plot:
    """All drives in the plan: filled where they hold their places, hollow where another holds them now.

    A line leads from a view to the place that was taken for its own, where that is farther away than the tolerance.
    """
    path = path_of(comparison)
    drawn = np.concatenate([_aside(path, stretch, number) for number, stretch in enumerate(path.stretches)])
    low, high = around([drawn, positions_of(comparison.query_views)], outline)
    width, height = np.maximum(high - low, 1.0)
    with page_look():
        figure = Figure(figsize=(10, float(np.clip(9 * height / width, 3, 9))), layout="constrained")
        axes = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        draw_walls(axes, outline)
        for number, (name, stretch) in enumerate(zip(merging.names, path.stretches, strict=True)):
            _draw_drive(axes, drawn, stretch, merging, COLOURS[number % len(COLOURS)], name)
        _draw_false(axes, path, drawn, merging, within)
        margin = 0.03 * (high - low) + 0.5
        axes.set(xlim=(low[0] - margin[0], high[0] + margin[0]), ylim=(low[1] - margin[1], high[1] + margin[1]))
        figure.legend(loc="outside upper center", ncols=5)
        return Plot(as_svg(figure))


def _aside(path: ReferencePath, stretch: slice, number: int) -> NDArray[np.float64]:
    right = path.headings[stretch] - math.pi / 2
    shift: NDArray[np.float64] = ASIDE * (number + 1) * np.stack([np.cos(right), np.sin(right)], axis=1)
    return path.points[stretch] + shift


def _draw_drive(
    axes: Axes, drawn: NDArray[np.float64], stretch: slice, merging: Merging, colour: str, name: str
) -> None:
    views = np.arange(stretch.start, stretch.stop)
    kept = merging.held_by[views] == views
    axes.plot(*drawn[views].T, color=colour, linewidth=0.6, alpha=0.7)
    label = f"{name} ({int(kept.sum())} of {len(kept)})"
    axes.plot(*drawn[views[kept]].T, ".", color=colour, markersize=5, label=label)
    axes.plot(*drawn[views[~kept]].T, "o", color=colour, markersize=3, markerfacecolor="none", markeredgewidth=0.6)


def _draw_false(
    axes: Axes, path: ReferencePath, drawn: NDArray[np.float64], merging: Merging, within: Tolerance
) -> None:
    moved = np.flatnonzero(merging.held_by != np.arange(path.size)).tolist()
    false = [v for v in moved if not path.within(path.pose(v), within)[merging.held_by[v]]]
    for number, view in enumerate(false):
        ends = drawn[[view, merging.held_by[view]]]
        label = f"joined with another place ({len(false)})"
        axes.plot(*ends.T, color=FAR_OFF, linewidth=0.7, linestyle=":", label=None if number else label)


def which_drive(comparison: Comparison, methods: Sequence[str], within: Tolerance) -> Plot:
    """P(sequence) over the views, a panel a method, and above it which drives truly pass there."""
    path = path_of(comparison)
    by = passing(path, path.near(comparison.query_views, within))
    names = comparison.drives.names if comparison.drives else ("",)
    strip = 0.25 + 0.16 * len(names)
    with page_look():
        figure = Figure(figsize=(10, strip + 1.5 * len(methods) + 1.0), layout="constrained")
        panels = figure.subplots(1 + len(methods), 1, sharex=True, height_ratios=[strip, *[1.5] * len(methods)])
        _draw_passing(panels[0], by, names)
        for axes, method in zip(panels[1:], methods, strict=True):
            _draw_shares(axes, shares(comparison.beliefs[method], path), names)
            axes.set(ylabel="P(sequence)", ylim=(0, 1), title=method_label(method))
        panels[-1].set(xlabel="query view", xlim=(-0.5, len(by) - 0.5))
        handles, labels = panels[-1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=5)
        return Plot(as_svg(figure))


def shares(beliefs: Sequence[Belief], path: ReferencePath) -> NDArray[np.float64]:
    """What each drive's places have of the belief, (D, M); what is left of 1 is P(lost)."""
    return np.array([[(1 - b.lost) * b.places[stretch].sum() for b in beliefs] for stretch in path.stretches])


def _draw_passing(axes: Axes, by: NDArray[np.bool_], names: Sequence[str]) -> None:
    for number in range(len(names)):
        views = np.flatnonzero(by[:, number])
        axes.plot(views, np.full(len(views), number), "s", color=COLOURS[number % len(COLOURS)], markersize=3.2)
    axes.set(ylim=(len(names) - 0.4, -0.6), title="truth: which drives pass")
    axes.set_yticks(range(len(names)), names, fontsize=7)


def _draw_shares(axes: Axes, found: NDArray[np.float64], names: Sequence[str]) -> None:
    over = np.arange(found.shape[1])
    stacked = np.vstack([found, 1 - found.sum(axis=0)])
    # A drive may be called anything, "lost" among it.
    looks = [
        *(
            (name, COLOURS[n % len(COLOURS)], HATCHES[n // len(COLOURS) % len(HATCHES)], 0.85)
            for n, name in enumerate(names)
        ),
        ("lost", INK, "", 0.25),
    ]
    low = np.zeros(found.shape[1])
    for (name, colour, hatch, opacity), share in zip(looks, stacked, strict=True):
        axes.fill_between(
            over, low, low + share, step="mid", color=colour, alpha=opacity, hatch=hatch, linewidth=0, label=name
        )
        low = low + share
