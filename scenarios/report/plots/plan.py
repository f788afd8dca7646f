"""The floor plan with both true paths, the faults, and the answers that are not simply right."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.style import (
    INK,
    NARROW_WIDTH,
    QUERY,
    REFERENCE,
    RIGHT,
    WALL,
    WIDTH,
    WRONG,
    Plot,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.report.plots.truth import positions_of
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.score import Score

FloorOutline = Sequence[NDArray[np.float64]]
"""Walls as polylines of (m, 2) points [m]."""

OUTCOME_STYLES: Mapping[Outcome, tuple[str, str]] = {
    Outcome.WRONG: ("X", WRONG),
    Outcome.MISSED: ("v", WRONG),
    Outcome.FALSE_FIX: ("P", WRONG),
    Outcome.REJECTED: ("d", RIGHT),
}

STRIP = 4.0
"""A path this many times longer than wide (or wider than long) is stretched, or it would be drawn as a hair."""

QUERY_WALLS = "walls, as the query met them"
"""Label of the walls, and of what stands between them, in plans that show the reference too: both may have moved."""

SURROUNDINGS = 6.0
"""Width of the world drawn around the drives [m]."""


@page_style
def drive_plan(
    comparison: Comparison, score: Score, outline: FloorOutline | None, spans: Sequence[FaultSpan] = ()
) -> Plot:
    """Both true paths in the plan, with faults, and with what became of the views that are not simply right."""
    reference, query = _broken(comparison), positions_of(comparison.query_views)
    floor = floor_plan([reference, query], outline, width=NARROW_WIDTH, walls=QUERY_WALLS)
    _draw_drives(floor.axes, reference, query)
    _draw_faults(floor.axes, query, spans)
    _draw_outcomes(floor.axes, comparison, score)
    floor.frame(np.maximum(floor.size, 1.0) * (0.02, 0.1))
    plot = with_legend(floor.figure)
    if not floor.stretched:
        return plot
    return replace(plot, note=f"The y axis is drawn {_stretch(floor.axes):.1f} times as large as the x axis.")


@dataclass(frozen=True, slots=True)
class PlanFigure:
    """A figure that shows the walls and is as large as what is to be drawn; ``stretched`` where the scales differ."""

    figure: Figure
    axes: Axes
    stretched: bool
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def size(self) -> NDArray[np.float64]:
        """Width and height of what is drawn [m]."""
        return self.high - self.low

    def frame(self, margin: NDArray[np.float64]) -> None:
        """Show all that is drawn, and so much around it to the sides and above [m]."""
        (west, south), (east, north) = self.low - margin, self.high + margin
        self.axes.set(xlim=(west, east), ylim=(south, north))


def _broken(comparison: Comparison) -> NDArray[np.float64]:
    """The true positions of the reference views [m], with a gap between one drive and the next."""
    gap = np.full((1, 2), math.nan)
    found = [positions_of(comparison.reference_views[stretch]) for stretch in comparison.stretches]
    return np.concatenate([part for one in found for part in (one, gap)][:-1])


def floor_plan(
    lines: Sequence[NDArray[np.float64]],
    outline: FloorOutline | None,
    *,
    stretch: bool = True,
    width: float = WIDTH,
    walls: str = "walls",
) -> PlanFigure:
    """A plan with the walls, ``width`` [inch], for lines of (m, 2) points [m]; a strip is stretched if it may be.

    ``walls`` is their label in the legend.
    """
    low, high = _around(lines, outline)
    east, north = np.maximum(high - low, 1.0)
    stretched = stretch and not 1 / STRIP < east / north < STRIP
    tall = 0.9 * width * north / east
    figure = new_figure(2.9 if stretched else float(np.clip(tall, 0.3 * width, 0.9 * width)), width)
    axes = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", aspect="auto" if stretched else "equal")
    for number, wall in enumerate(outline or ()):
        axes.plot(wall[:, 0], wall[:, 1], color=WALL, linewidth=1.2, label=None if number else walls)
    return PlanFigure(figure, axes, stretched, low, high)


def _around(
    drives: Sequence[NDArray[np.float64]], outline: FloorOutline | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of what is drawn [m]: of all walls, but not farther than ``SURROUNDINGS`` from where was driven."""
    driven = np.concatenate(drives)
    driven = driven[np.isfinite(driven).all(axis=1)]
    low, high = driven.min(axis=0), driven.max(axis=0)
    if not outline:
        return low, high
    near, far = low - SURROUNDINGS, high + SURROUNDINGS
    for wall in outline:
        begin, end = np.nanmin(wall, axis=0), np.nanmax(wall, axis=0)
        if (begin <= far).all() and (end >= near).all():  # else none of it is in sight
            low, high = np.minimum(low, np.maximum(begin, near)), np.maximum(high, np.minimum(end, far))
    return low, high


def _draw_drives(axes: Axes, reference: NDArray[np.float64], query: NDArray[np.float64]) -> None:
    """The reference as a broad pale way, the query as a thin line on it: told apart without colour as well."""
    axes.plot(*reference.T, color=REFERENCE, linewidth=5, alpha=0.35, solid_capstyle="butt")
    axes.plot(*reference.T, "o", color=REFERENCE, markersize=3.2, markerfacecolor="none", label="reference views")
    axes.plot(*query.T, color=QUERY, linewidth=0.9, marker=".", markersize=3.5, label="query views")


def _draw_faults(axes: Axes, query: NDArray[np.float64], spans: Sequence[FaultSpan]) -> None:
    """A kidnap as a dotted line from where the robot was to where it was set down, other faults as a broad band."""
    for span in spans:
        if span.carried:
            way = query[max(span.first - 1, 0) : span.first + 1]
            axes.plot(*way.T, color=INK, linewidth=1.2, linestyle=":", marker="*", markevery=[-1], label=span.label)
        else:
            way = query[span.first : span.last + 1]
            axes.plot(*way.T, color=INK, alpha=0.2, linewidth=7, solid_capstyle="butt", label=span.label)


def _draw_outcomes(axes: Axes, comparison: Comparison, score: Score) -> None:
    positions = positions_of(comparison.query_views)
    for outcome, (marker, colour) in OUTCOME_STYLES.items():
        chosen = [i for i, found in enumerate(score.outcomes) if found is outcome]
        if chosen:
            label = f"{outcome.value} ({len(chosen)})"
            size = 4 if outcome is Outcome.REJECTED else 7
            axes.plot(*positions[chosen].T, marker, color=colour, markersize=size, markeredgewidth=0, label=label)


def _stretch(axes: Axes) -> float:
    """Size of a metre of y on the page over that of a metre of x."""
    box = axes.get_window_extent()
    return float(box.height / abs(np.ptp(axes.get_ylim())) / (box.width / abs(np.ptp(axes.get_xlim()))))
