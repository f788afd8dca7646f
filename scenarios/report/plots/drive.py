"""The report's plots, as SVG text that takes the colour of the page around it."""

import io
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, PowerNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.planar import Pose
from refseq.view import View
from scenarios.scoring.comparison import Comparison, Drives, method_label
from scenarios.scoring.fault_spans import Incident
from scenarios.scoring.metrics import Retrieval
from scenarios.scoring.outcome import Outcome
from scenarios.scoring.path_geometry import ReferencePath, Tolerance
from scenarios.scoring.reliability import Reliability
from scenarios.scoring.score import Score

FloorOutline = Sequence[NDArray[np.float64]]
"""Walls as polylines of (m, 2) points [m]."""

INK = "#010203"
"""Stands for the colour of the page's text; no plot uses it for anything else."""

Line = str | tuple[int, tuple[int, ...]]
"""As matplotlib takes it: a word, or an offset and lengths of dashes and gaps."""

Style = tuple[str, Line, str]
"""Colour, line and marker: methods are told apart with any colour vision, and without colour."""

STAGE_STYLES: Mapping[str, Style] = {
    Stage.UNIFORM: ("#8a8a8a", ":", "o"),
    Stage.PRIOR: ("#2a8fd4", "--", "s"),
    Stage.CHAIN: ("#d55e00", "-", "x"),
}
"""Of the first profile in a plot, or of stages without one."""

OTHER_STYLES: Sequence[Style] = (
    ("#2a9d6f", "-.", "^"),
    ("#9467bd", (0, (5, 1, 1, 1, 1, 1)), "D"),
    ("#b8860b", (0, (1, 1)), "v"),
    ("#2f9aa8", (0, (8, 2)), "P"),
    ("#d6409f", (0, (3, 1)), "*"),
    ("#a0695d", (0, (6, 2, 2, 2)), "<"),
    ("#4a78c8", (0, (2, 2)), ">"),
    ("#7f9c1f", (0, (10, 2, 2, 2)), "h"),
    ("#e0685e", (0, (1, 3)), "p"),
    ("#3f7f00", (0, (8, 2, 1, 2, 1, 2)), "X"),
    ("#5b5bd6", (0, (4, 4)), "d"),
    ("#a14fa8", (0, (12, 3)), "H"),
    ("#00798c", (0, (3, 1, 1, 1)), "8"),
    ("#c46a2b", (0, (6, 1, 1, 1, 1, 1, 1, 1)), "1"),
    ("#6b7a8f", (0, (2, 1, 6, 1)), "2"),
    ("#c4383b", (0, (14, 2, 4, 2)), "3"),
)
"""For other methods, one after the other; when they are used up they come again. All stand out from light
paper and from dark, three to one at least."""

REFERENCE, QUERY, WALL = "#2a8fd4", "#d55e00", "#8a8a8a"

OUTCOME_STYLES: Mapping[Outcome, tuple[str, str]] = {
    Outcome.WRONG: ("X", "#d6409f"),
    Outcome.MISSED: ("v", "#d6409f"),
    Outcome.FALSE_FIX: ("P", "#d6409f"),
    Outcome.REJECTED: ("d", "#2a9d6f"),
}

HATCHES = ("////", "....", "xxxx", "----")
"""What tells faults on the drive apart: colour is left to the methods."""

STRIP = 4.0
"""A path this many times longer than wide (or wider than long) is stretched, or it would be drawn as a hair."""

SURROUNDINGS = 6.0
"""How much of a world is drawn around the drives [m]."""

CHARACTERS = 100
"""About how many fit side by side along the axis of a plot as wide as the page."""


def page_look() -> AbstractContextManager[None]:
    """How all plots look, for as long as one is drawn."""
    return mpl.rc_context(
        {
            "svg.fonttype": "none",
            "svg.hashsalt": "refseq",
            "font.family": "sans-serif",
            "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
            "font.size": 9,
            "axes.titlesize": 10,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
            "figure.facecolor": "none",
            "axes.facecolor": "none",
            "savefig.facecolor": "none",
            "text.color": INK,
            "axes.edgecolor": INK,
            "axes.labelcolor": INK,
            "xtick.color": INK,
            "ytick.color": INK,
        }
    )


@dataclass(frozen=True, slots=True)
class Plot:
    """A drawing as SVG text, and what a reader must know about its scale."""

    svg: str
    note: str = ""


def plan(
    comparison: Comparison, score: Score, outline: FloorOutline | None, incidents: Sequence[Incident] = ()
) -> Plot:
    """Both true paths in the plan, with faults, and with what became of the views that are not simply right."""
    lines = [_broken(comparison), positions_of(comparison.query_views)]
    low, high = around(lines, outline)
    width, height = np.maximum(high - low, 1.0)
    stretched = not 1 / STRIP < width / height < STRIP
    with page_look():
        figure = Figure(
            figsize=(10, 2.9 if stretched else float(np.clip(9 * height / width, 3, 9))), layout="constrained"
        )
        axes = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", aspect="auto" if stretched else "equal")
        draw_walls(axes, outline)
        _draw_drives(axes, lines[0], lines[1])
        _draw_incidents(axes, lines[1], incidents)
        _draw_outcomes(axes, comparison, score)
        margin = np.maximum(high - low, 1.0) * (0.02, 0.1)
        limits = np.stack([low - margin, high + margin], axis=1)
        axes.set(xlim=tuple(limits[0]), ylim=tuple(limits[1]))
        figure.legend(loc="outside upper center", ncols=6)
        svg = as_svg(figure)
        factor = _stretch(axes)
    return Plot(svg, f"The y axis is drawn {factor:.1f} times as large as the x axis." if stretched else "")


def _broken(comparison: Comparison) -> NDArray[np.float64]:
    """The true positions of the reference views [m], with a gap between one drive and the next."""
    gap = np.full((1, 2), math.nan)
    found = [positions_of(comparison.reference_views[stretch]) for stretch in comparison.stretches]
    return np.concatenate([part for one in found for part in (one, gap)][:-1])


def around(
    drives: Sequence[NDArray[np.float64]], outline: FloorOutline | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of what is drawn [m]: of all walls, but not farther than ``SURROUNDINGS`` from where was driven."""
    driven = np.concatenate(drives)
    driven = driven[np.isfinite(driven).all(axis=1)]
    low, high = driven.min(axis=0), driven.max(axis=0)
    if not outline:
        return low, high
    walls = np.concatenate(list(outline))
    walls = walls[np.isfinite(walls).all(axis=1)]
    inside = np.clip(walls, low - SURROUNDINGS, high + SURROUNDINGS)
    return np.minimum(low, inside.min(axis=0)), np.maximum(high, inside.max(axis=0))


def draw_walls(axes: Axes, outline: FloorOutline | None) -> None:
    """The walls as grey lines."""
    for number, wall in enumerate(outline or ()):
        axes.plot(wall[:, 0], wall[:, 1], color=WALL, linewidth=1.2, label=None if number else "walls")


def _draw_drives(axes: Axes, reference: NDArray[np.float64], query: NDArray[np.float64]) -> None:
    """The reference as a broad pale way, the query as a thin line on it: told apart without colour as well."""
    axes.plot(*reference.T, color=REFERENCE, linewidth=5, alpha=0.35, solid_capstyle="butt")
    axes.plot(*reference.T, "o", color=REFERENCE, markersize=3.2, markerfacecolor="none", label="reference views")
    axes.plot(*query.T, color=QUERY, linewidth=0.9, marker=".", markersize=3.5, label="query views")


def _draw_incidents(axes: Axes, query: NDArray[np.float64], incidents: Sequence[Incident]) -> None:
    """A kidnap as a dotted line from where the robot was to where it was set down, other faults as a broad band."""
    for incident in incidents:
        if incident.carried:
            way = query[max(incident.first - 1, 0) : incident.first + 1]
            axes.plot(*way.T, color=INK, linewidth=1.2, linestyle=":", marker="*", markevery=[-1], label=incident.label)
        else:
            way = query[incident.first : incident.last + 1]
            axes.plot(*way.T, color=INK, alpha=0.2, linewidth=7, solid_capstyle="butt", label=incident.label)


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


def styles(methods: Iterable[str]) -> dict[str, Style]:
    """A style for each method; the stages of the first profile among them have those of stages."""
    others, profile = itertools.cycle(OTHER_STYLES), None
    found: dict[str, Style] = {}
    for method in methods:
        of, _, stage = method.rpartition("/")
        profile = of if profile is None and stage in STAGE_STYLES else profile
        found[method] = STAGE_STYLES[stage] if of == profile and stage in STAGE_STYLES else next(others)
    return found


PANELS = 3
"""Heat maps side by side; of several drives, which hold more places, one less."""
FINEST = 200, 320
"""Rows and columns that a heat map has at most: more would be finer than what a screen shows."""
BELIEF, TRUTH = QUERY, REFERENCE
SWATCHES = (0.01, 0.1, 0.5, 1.0)
"""Probabilities that a legend shows, as far as they can be seen."""
OVER_PLACES = 0.5
"""Power of the colour: the square root, or a belief over hundreds of places could not be seen."""


def posterior(
    comparison: Comparison, path: ReferencePath | None, wide: Tolerance, incidents: Sequence[Incident] = ()
) -> Plot:
    """Probability of every place at every view, one panel a method, over the band of right answers."""
    methods, places = list(comparison.beliefs), len(comparison.reference_views)
    columns = min(PANELS - (len(comparison.stretches) > 1), len(methods))
    rows = math.ceil(len(methods) / columns)
    with page_look():
        figure = Figure(figsize=(10, rows * 11 / max(columns, 2) + 0.6), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes, method in itertools.zip_longest(panels.flat, methods):
            if method is None:
                axes.set_visible(False)
                continue
            if path is not None:
                draw_truth(axes, comparison.query_views, path, wide, [one.first for one in incidents if one.carried])
            _draw_posterior(axes, comparison.beliefs[method], places)
            for incident in incidents:
                _edge(axes, incident)
            axes.set(title=method_label(method), xlim=(-1, len(comparison.query_views)), ylim=(-1, places * 1.05))
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        # Where the last row is not full, the numbers stand below the panel above its gap.
        for column in range(columns):
            lowest = panels[(len(methods) - 1 - column) // columns, column]
            lowest.set_xlabel("query view")
            lowest.tick_params(labelbottom=True)
        for axes in panels[:, 0]:
            axes.set_ylabel("reference place")
        if comparison.drives is not None and len(comparison.stretches) > 1:
            _mark_drives(panels, comparison.drives)
        right = Patch(facecolor=TRUTH, alpha=0.35, edgecolor=TRUTH, linewidth=0.7, label="right answers")
        says_lost = Line2D([], [], color=INK, marker="v", markersize=4, linestyle="none", label="says lost")
        belief_legend(figure, "P(place | on the path)", OVER_PLACES, *([right] if path else []), says_lost)
        return Plot(as_svg(figure), coarser_note(places, len(comparison.query_views)))


def _mark_drives(panels: NDArray[Any], drives: Drives) -> None:
    """Draw a line between the places of one drive and of the next; their names stand in place of numbers."""
    for axes in panels.flat:
        for stretch in drives.stretches[1:]:
            axes.axhline(stretch.start - 0.5, color=INK, alpha=0.35, linewidth=0.6)
    for axes in panels[:, 0]:
        middles = [(stretch.start + stretch.stop - 1) / 2 for stretch in drives.stretches]
        axes.set_yticks(middles, [plain_text(name) for name in drives.names], fontsize=8)
        axes.tick_params(axis="y", length=0)
        axes.set_ylabel("places of each drive, in their order")


def _draw_posterior(axes: Axes, beliefs: Sequence[Belief], places: int) -> None:
    draw_belief(axes, np.stack([belief.places for belief in beliefs], axis=1), OVER_PLACES)
    lost = [t for t, belief in enumerate(beliefs) if belief.lost > LOST_ABOVE]
    axes.plot(lost, [places * 1.025] * len(lost), "v", color=INK, markersize=3.5, markeredgewidth=0)


def draw_belief(axes: Axes, shares: NDArray[np.float64], power: float) -> None:
    """Probabilities, (rows, views), as a colour as opaque as a ``power`` of them: what lies below shows through."""
    colours = ListedColormap([(*to_rgb(BELIEF), opacity) for opacity in np.linspace(0, 1, 256)])
    coarse = coarser(shares)
    each = np.ceil(np.array(shares.shape) / FINEST).clip(1)
    height, width = np.array(coarse.shape) * each
    axes.imshow(
        coarse, norm=PowerNorm(power, 0, 1), cmap=colours, origin="lower", aspect="auto", interpolation="none",
        extent=(-0.5, width - 0.5, -0.5, height - 0.5), zorder=2,
    )  # fmt: skip


def coarser(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """The highest of as many neighbours as it takes to have no more than ``FINEST`` rows and columns."""
    for axis, finest in enumerate(FINEST):
        each = max(1, math.ceil(shares.shape[axis] / finest))
        shares = np.maximum.reduceat(shares, range(0, shares.shape[axis], each), axis=axis)
    return shares


def coarser_note(places: int, views: int) -> str:
    """What a reader must know where a heat map is coarser than what it shows."""
    each = [math.ceil(count / finest) for count, finest in zip((places, views), FINEST, strict=True)]
    told = [f"{n} {what}" for n, what in zip(each, ("places", "views"), strict=True) if n > 1]
    return f"Each cell is the highest of {' and '.join(told)}." if told else ""


def belief_legend(figure: Figure, shown: str, power: float, *more: Artist) -> None:
    """A legend of probabilities, by what is ``shown``, and of whatever more there is."""
    handles = [
        Patch(facecolor=BELIEF, alpha=share**power, linewidth=0, label=f"{'' if n else shown + ' = '}{share:g}")
        for n, share in enumerate(share for share in SWATCHES if share**power > 0.05)
    ]
    figure.legend(handles=[*handles, *more], loc="outside upper center", ncols=len(handles) + len(more))


def draw_truth(axes: Axes, views: Sequence[View], path: ReferencePath, wide: Tolerance, carried: Sequence[int]) -> None:
    """A band from the tolerance before the true position to that behind; broken off the map, and where a kidnap ended.

    Of several drives each that passes there has its own.
    """
    for drive in path.stretches:
        known = drive.start + np.flatnonzero(np.isfinite(path.along[drive]))
        true = np.array([_true_along(view.truth, path, wide, drive) for view in views])
        over = np.insert(np.arange(len(true), dtype=float), carried, np.nan)
        low, high = (
            np.insert(np.interp(true + offset, path.along[known], known), carried, np.nan)
            for offset in (-wide.distance, wide.distance)
        )
        for edge in (low, high):
            axes.plot(over, edge, color=TRUTH, alpha=0.6, linewidth=0.6, zorder=1)
        axes.fill_between(over, low, high, color=TRUTH, alpha=0.35, linewidth=0, zorder=1)


def _edge(axes: Axes, incident: Incident) -> None:
    """A fault: a line where it begins, and one where it ends."""
    for at in (incident.first - 0.5, *(() if incident.carried else (incident.last + 0.5,))):
        axes.axvline(at, color=INK, alpha=0.6, linewidth=0.8, linestyle="--", zorder=3)


def _shade_incidents(axes: Axes, incidents: Sequence[Incident], *, labelled: bool = True) -> None:
    """Faults over the query's views: a hatched stretch, or a line where the robot was carried away."""
    for number, incident in enumerate(incidents):
        stretch = incident.first - 0.5, incident.last + 0.5
        _shade_incident(axes, incident, number, stretch, incident.label if labelled else None)


def _shade_incident(
    axes: Axes, incident: Incident, number: int, stretch: tuple[float, float], label: str | None
) -> None:
    if incident.carried:
        axes.axvline(stretch[0], color=INK, linewidth=1.2, linestyle=":", label=label)
    else:
        hatch = HATCHES[number % len(HATCHES)]
        axes.axvspan(*stretch, hatch=hatch, facecolor="none", edgecolor=INK, alpha=0.3, linewidth=0, label=label)


def lost(
    comparison: Comparison, path: ReferencePath | None, wide: Tolerance, incidents: Sequence[Incident] = ()
) -> Plot:
    """Probability of being lost, and entropy of the places, over the views."""
    with page_look():
        figure = Figure(figsize=(10, 4.2), layout="constrained")
        top, bottom = figure.subplots(2, 1, sharex=True)
        looks = styles(comparison.beliefs)
        for method, beliefs in comparison.beliefs.items():
            colour, line, _ = looks[method]
            style = {"color": colour, "linestyle": line, "linewidth": 1.3}
            top.plot([belief.lost for belief in beliefs], label=method_label(method), **style)
            bottom.plot([belief.entropy for belief in beliefs], **style)
        _threshold(top, LOST_ABOVE, "above: says lost")
        _threshold(bottom, math.log(len(comparison.reference_views)), "knows nothing (ln K)")
        if path is not None:
            _shade_off_map(top, comparison.query_views, path, wide)
        _shade_incidents(top, incidents)
        _shade_incidents(bottom, incidents, labelled=False)
        top.set(ylabel="P(lost)", ylim=(-0.03, 1.03))
        bottom.set(ylabel="entropy [nats]", xlabel="query view", xlim=(-1, len(comparison.query_views)))
        bottom.set_ylim(0, 1.15 * max(1.0, math.log(len(comparison.reference_views))))
        draw_grid(top, bottom)
        figure.legend(loc="outside upper center", ncols=4)
        return Plot(as_svg(figure))


def _threshold(axes: Axes, height: float, text: str) -> None:
    axes.axhline(height, color=INK, linewidth=0.7, alpha=0.6)
    axes.annotate(
        text, (1, height), (-2, 2), ("axes fraction", "data"), "offset points", ha="right", va="bottom", fontsize=8
    )


def _shade_off_map(axes: Axes, views: Sequence[View], path: ReferencePath, wide: Tolerance) -> None:
    off = [t for t, view in enumerate(views) if view.truth is not None and not path.within(view.truth, wide).any()]
    for number, t in enumerate(off):
        axes.axvspan(
            t - 0.5, t + 0.5, color="#2a9d6f", alpha=0.25, linewidth=0, label=None if number else "off the map"
        )


def errors(
    comparison: Comparison,
    scores: Mapping[str, Score],
    path: ReferencePath,
    tolerances: Sequence[Tolerance],
    incidents: Sequence[Incident] = (),
) -> Plot:
    """Absolute error along the path of every answer given, over the true position."""
    true = np.array([_true_along(view.truth, path, tolerances[0]) for view in comparison.query_views])
    with page_look():
        figure = Figure(figsize=(10, 3.4), layout="constrained")
        axes = figure.add_subplot(
            xlabel="true position along the reference path [m]", ylabel="error along the path [m]"
        )
        looks = styles(scores)
        for method, score in scores.items():
            _draw_errors(axes, true, score, looks[method], method_label(method))
        _error_axis(axes, scores, tolerances)
        _shade_positions(axes, true, incidents)
        figure.legend(loc="outside upper center", ncols=3)
        return Plot(as_svg(figure))


def _shade_positions(axes: Axes, true: NDArray[np.float64], incidents: Sequence[Incident]) -> None:
    """Where along the reference path the query's faults were, as far as it was on the map there."""
    for number, incident in enumerate(incidents):
        there = true[incident.first : incident.last + 1]
        if np.isfinite(there).any():
            _shade_incident(axes, incident, number, (np.nanmin(there), np.nanmax(there)), incident.label)


def reliability(scores: Mapping[str, Score]) -> Plot:
    """How often what was said with some probability came true: of the top place, and of being lost."""
    looks = styles(scores)
    # P(lost) can be judged only by drives that leave the map.
    leaves = any(score.off_map.any() for score in scores.values())
    with page_look():
        figure = Figure(figsize=(10, 4.9), layout="constrained")
        panels = figure.subplots(2, 2, sharex=True, height_ratios=(3, 1), squeeze=False)
        for column, title in enumerate(("top place: is it the nearest one?", "P(lost): is it off the map?")):
            shares, counts = panels[:, column]
            if column == 1 and not leaves:
                shares.set_visible(False)
                counts.set_visible(False)
                continue
            shares.plot([0, 1], [0, 1], color=INK, linewidth=0.7, alpha=0.6)
            for method, score in scores.items():
                found = score.lost_reliability if column else score.top_reliability
                _draw_reliability(shares, counts, found, looks[method], None if column else method_label(method))
            shares.set(title=title, ylabel="share that came true", xlim=(-0.02, 1.02), ylim=(-0.03, 1.03))
            counts.set(xlabel="probability", ylabel="views", ylim=(0, None))
            draw_grid(shares, counts)
        figure.legend(loc="outside upper center", ncols=3)
        return Plot(as_svg(figure))


def _draw_reliability(shares: Axes, counts: Axes, found: Reliability, style: Style, label: str | None) -> None:
    """A line through the bins that hold views, its markers larger where there are more; below it how many there are."""
    colour, line, marker = style
    there = found.count > 0
    sizes = 6 + 60 * found.count[there] / found.count.sum()
    shares.plot(found.probability[there], found.share[there], color=colour, linestyle=line, linewidth=1, label=label)
    shares.scatter(found.probability[there], found.share[there], sizes, color=colour, marker=marker, linewidths=1)
    edges = np.linspace(0, 1, len(found.count) + 1)
    counts.stairs(found.count, edges, color=colour, linestyle=line, linewidth=1)


def certainty(comparison: Comparison, scores: Mapping[str, Score], tolerances: Sequence[Tolerance]) -> Plot:
    """Absolute error along the path of every answer given, over the entropy of its belief."""
    with page_look():
        figure = Figure(figsize=(10, 3.4), layout="constrained")
        axes = figure.add_subplot(xlabel="entropy of the places [nats]", ylabel="error along the path [m]")
        looks = styles(scores)
        for method, score in scores.items():
            entropies = np.array([belief.entropy for belief in comparison.beliefs[method]])
            _draw_errors(axes, entropies, score, looks[method], method_label(method))
        _error_axis(axes, scores, tolerances)
        axes.set_xlim(left=-0.05)
        figure.legend(loc="outside upper center", ncols=3)
        return Plot(as_svg(figure))


def _draw_errors(axes: Axes, over: NDArray[np.float64], score: Score, style: Style, label: str) -> None:
    """A mark for every answer given: its absolute error, over what is given for each view, (M,)."""
    colour, _, marker = style
    axes.plot(over, np.abs(score.errors), marker, color=colour, markersize=4, markerfacecolor="none", label=label)


def _error_axis(axes: Axes, scores: Mapping[str, Score], tolerances: Sequence[Tolerance]) -> None:
    """Errors upwards, linear up to 1 m and logarithmic above, the tolerances shaded."""
    axes.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    top = max(2.0, *(np.nanmax(np.abs(s.errors), initial=0.0) for s in scores.values())) * 1.2
    ticks = [t for t in (0, 0.5, 1.5, 5, 10, 20, 50, 100, 200, 500) if t <= top]
    axes.set(ylim=(-0.05, top), yticks=ticks, yticklabels=[f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    for tolerance in tolerances:
        axes.axhspan(0, tolerance.distance, color="#2a9d6f", alpha=0.12, linewidth=0)
    draw_grid(axes)


def _true_along(pose: Pose | None, path: ReferencePath, wide: Tolerance, drive: slice | None = None) -> float:
    """Find the true position along the reference path [m], nan for a view that is off the map or has no truth.

    Of several drives it is along the one that is given, or along the nearest.
    """
    if pose is None or not path.within(pose, wide)[drive or slice(None)].any():
        return math.nan
    return path.project(pose, drive)


def positions_of(views: Sequence[View]) -> NDArray[np.float64]:
    """Collect the true positions (n, 2) [m], nan where unknown."""
    truths = [view.truth for view in views]
    return np.array([(pose.x, pose.y) if pose else (math.nan, math.nan) for pose in truths]).reshape(-1, 2)


def retrieval(scores: Mapping[str, Score]) -> Plot:
    """Precision over recall of each method's answers, from the surest on."""
    curves = {method: score.retrieval for method, score in scores.items()}
    with page_look():
        figure = Figure(figsize=(10, 4.4), layout="constrained")
        axes = figure.add_subplot(xlabel="recall", ylabel="precision", xlim=(-0.01, 1.01), ylim=(0, 1.03))
        looks = styles(scores)
        for method, curve in curves.items():
            if curve is not None:
                draw_retrieval(axes, curve, looks[method], method_label(method))
        draw_grid(axes)
        figure.legend(loc="outside upper center", ncols=3)
        return Plot(as_svg(figure))


def draw_retrieval(axes: Axes, curve: Retrieval, style: Style, label: str) -> None:
    """The curve as steps, so that what lies under them is its area; a mark where all answers are taken."""
    colour, line, marker = style
    recall, precision = np.concatenate([[0.0], curve.recall]), np.concatenate([curve.precision[:1], curve.precision])
    named = f"{label} (AUC {curve.auc:.3f})"
    axes.step(recall, precision, where="pre", color=colour, linestyle=line, linewidth=1.3, label=named)
    axes.plot(recall[-1:], precision[-1:], marker, color=colour, markersize=6)


@dataclass(frozen=True, slots=True)
class Dial:
    """A share over a key that several cases vary: the key, its values in words, and where they stand on its axis.

    ``at`` is None for values that are no numbers: they stand side by side. ``shares`` holds for each method a row
    (value, low, high) a case, in [0, 1], nan where there is none. Values are in the order of the axis.
    """

    key: str
    values: Sequence[str]
    at: Sequence[float] | None
    shares: Mapping[str, NDArray[np.float64]]


def dial(found: Dial) -> Plot:
    """Success over what is varied, with 95 % intervals, a line a method."""
    at = np.arange(len(found.values), dtype=float) if found.at is None else np.array(found.at, dtype=float)
    spread = 0.012 * max(float(np.ptp(at)), 1e-9)
    with page_look():
        figure = Figure(figsize=(10, 4.2), layout="constrained")
        axes = figure.add_subplot(xlabel=found.key, ylabel="success [%]", ylim=(-3, 103))
        looks = styles(found.shares)
        for number, (method, shares) in enumerate(found.shares.items()):
            colour, line, marker = looks[method]
            # Side by side, or the intervals of equal shares would hide one another.
            there = at + spread * (number - (len(found.shares) - 1) / 2)
            style = colour, "none" if found.at is None else line, marker
            draw_shares(axes, there, shares, style, method_label(method))
        axes.set_xticks(at, _staggered(at, found.values), rotation=0 if len(found.values) <= 8 else 30)
        draw_grid(axes)
        figure.legend(loc="outside upper center", ncols=4)
        return Plot(as_svg(figure))


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


def draw_shares(axes: Axes, at: NDArray[np.float64], shares: NDArray[np.float64], style: Style, label: str) -> None:
    """One method's shares [%] with their intervals; ``shares`` holds rows (value, low, high)."""
    colour, line, marker = style
    value, low, high = 100 * shares.T
    bars = np.nan_to_num(np.clip([value - low, high - value], 0, None))
    axes.errorbar(
        at, value, bars, color=colour, marker=marker, markersize=5, linewidth=1.3, elinewidth=0.8, capsize=2,
        linestyle=line, label=label,
    )  # fmt: skip


def draw_grid(*panels: Axes) -> None:
    """A faint grid behind what is drawn."""
    for axes in panels:
        axes.grid(color=INK, alpha=0.12, linewidth=0.6)


def plain_text(name: str) -> str:
    """A name from outside as it is written: matplotlib takes what stands between dollars for mathematics."""
    return name.replace("$", r"\$")


def as_svg(figure: Figure) -> str:
    """Write the figure as an ``<svg>`` element in the page's own ink."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :].replace(INK, "currentColor")
