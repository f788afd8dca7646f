"""Answers along the map over the way that the robot came, by odometry: the picture that needs no truth."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE
from refseq_bench.scenarios.report.plots.style import (
    FAULTY,
    INK,
    NARROW_WIDTH,
    Plot,
    draw_grid,
    method_styles,
    new_figure,
    page_style,
    with_legend,
)
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.consistency.answers import (
    OdometricPlaces,
    given_answers,
    is_assumed,
    odometer_steps,
    odometric_places,
)
from refseq_bench.scenarios.scoring.consistency.jumps import jumped
from refseq_bench.scenarios.scoring.path_geometry import Tolerance


@page_style
def answers_over_odometer(comparison: Comparison, judged: str, tolerance: Tolerance) -> Plot:
    """Distance along the map of each method's answers, over the query's odometer; jumps of the judged method.

    Drives of several stand above each other. Where a drive has no odometry, its places or views are counted instead.
    """
    places = odometric_places(comparison)
    heights = _heights(comparison, places)
    figure = new_figure(3.8, NARROW_WIDTH)
    axes = figure.add_subplot()
    for method, (colour, _, marker) in method_styles(comparison.beliefs).items():
        answers = given_answers(comparison, method)
        at, size = _travelled(comparison)[answers.views], 5 if method == judged else 3.5
        (drawn,) = axes.plot(at, heights[answers.places], marker, color=colour, markersize=size)
        drawn.set(markerfacecolor="none", label=method_label(method))
    _draw_steps(axes, comparison, judged, heights, places, tolerance)
    _draw_lost(axes, comparison, judged, float(np.max(heights, initial=1.0)))
    _label(axes, comparison, heights, places)
    draw_grid(axes)
    return with_legend(figure)


def _heights(comparison: Comparison, places: OdometricPlaces) -> NDArray[np.float64]:
    """Where each place stands on the upward axis, (K,): metres along its drive, or places, above the drives before."""
    heights, base = np.zeros(len(places.along)), 0.0
    measured = bool(np.isfinite(places.along).all())
    for stretch in comparison.stretches:
        own = places.along[stretch] if measured else np.arange(stretch.stop - stretch.start, dtype=float)
        heights[stretch] = base + own
        base += float(np.max(own, initial=0.0)) * 1.06
    return heights


def _travelled(comparison: Comparison) -> NDArray[np.float64]:
    """Where each query view stands on the axis to the right, (M,): metres by the odometer, or views."""
    steps = odometer_steps(comparison.query_views)
    return np.cumsum(steps) if _driven(comparison) else np.arange(len(steps), dtype=float)


def _driven(comparison: Comparison) -> bool:
    """Tell whether the query has an odometer of its own."""
    return bool(odometer_steps(comparison.query_views).any()) and not is_assumed(comparison.query_metadata)


def _draw_steps(
    axes: Axes,
    comparison: Comparison,
    judged: str,
    heights: NDArray[np.float64],
    places: OdometricPlaces,
    tolerance: Tolerance,
) -> None:
    """Join the judged answers by a line, dotted where one is a jump."""
    answers = given_answers(comparison, judged)
    at, high = _travelled(comparison)[answers.views], heights[answers.places]
    jumps = jumped(answers, places, tolerance)
    broken = jumps | (np.diff(places.drive[answers.places]) != 0)
    ends = np.flatnonzero(broken) + 1
    axes.plot(np.insert(at, ends, math.nan), np.insert(high, ends, math.nan), color=INK, linewidth=0.7, alpha=0.6)
    for number, step in enumerate(np.flatnonzero(jumps)):
        label = None if number else f"jumps of {method_label(judged)} ({int(jumps.sum())})"
        axes.plot(at[step : step + 2], high[step : step + 2], color=FAULTY, linewidth=1, linestyle=":", label=label)


def _draw_lost(axes: Axes, comparison: Comparison, judged: str, top: float) -> None:
    """Marks at the foot of the views at which the judged method says lost."""
    lost = [t for t, belief in enumerate(comparison.beliefs[judged]) if belief.lost > LOST_ABOVE]
    if lost:
        at = _travelled(comparison)[lost]
        foot, label = np.full(len(lost), -0.04 * top), f"{method_label(judged)} says lost ({len(lost)})"
        axes.plot(at, foot, "v", color=INK, markersize=4, markeredgewidth=0, label=label)


def _label(axes: Axes, comparison: Comparison, heights: NDArray[np.float64], places: OdometricPlaces) -> None:
    measured, several = np.isfinite(places.along).all(), len(comparison.stretches) > 1
    driven = _driven(comparison)
    axes.set(
        xlabel="way of the query by its odometer [m]" if driven else "query view (there is no odometry)",
        ylabel="distance along the map [m]" if measured else "place of the map (there is no odometry)",
    )
    if not driven:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if several and comparison.drives is not None:
        for stretch in comparison.stretches[1:]:
            axes.axhline(heights[stretch.start], color=INK, alpha=0.35, linewidth=0.6)
        middles = [float(heights[stretch].mean()) for stretch in comparison.stretches]
        axes.set_yticks(middles, comparison.drives.names, fontsize=8)
        axes.set_ylabel("places of each drive, in their order")
