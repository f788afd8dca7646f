"""Drawings of a log: the path that was driven, and which topic spoke when."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from refseq_bench.scenarios.log_tools.timing import Timing
from refseq_bench.scenarios.report.plots.style import (
    BELIEF,
    FAULTY,
    NARROW_WIDTH,
    TRUTH,
    WALL,
    Plot,
    as_svg,
    draw_grid,
    new_figure,
    page_style,
    with_legend,
)

POINTS = 4000
"""Points of a path that are drawn: more make the page heavy, and no line smoother."""

MARGIN = 0.04
"""Share of the log's duration that is left free at either end of the timeline."""


class TimelineRow(NamedTuple):
    """A topic on the timeline, whether anything is read from it, and the stamp that is its time 0 [s]."""

    topic: str
    timing: Timing
    used: bool
    zero: float


@page_style
def path_drawing(paths: Mapping[str, NDArray[np.float64]]) -> Plot:
    """Paths (n, ≥ 2) of x and y [m] by their labels, the first the odometer's; a mark at each beginning."""
    size = np.ptp(np.concatenate([path[:, :2] for path in paths.values()]), axis=0)
    height = float(np.clip((NARROW_WIDTH - 1) * max(size[1], 1.0) / max(size[0], 1.0), 2.0, 6.0)) + 0.6
    figure = new_figure(height, NARROW_WIDTH)
    axes = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    draw_grid(axes)
    for (label, path), colour, line in zip(paths.items(), (BELIEF, TRUTH, WALL), ("-", "--", ":"), strict=False):
        shown = path[:: max(1, len(path) // POINTS)]
        axes.plot(shown[:, 0], shown[:, 1], line, color=colour, linewidth=1.4, label=label)
        axes.plot(*path[0, :2], "o", color=colour, markersize=6, markerfacecolor="none")
    axes.margins(0.06)
    return with_legend(figure)


@page_style
def timeline(rows: Sequence[TimelineRow], duration: float) -> Plot:
    """A bar for each topic, broken where it pauses, over the log's ``duration`` [s]."""
    figure = new_figure(0.8 + 0.32 * len(rows))
    axes = figure.add_subplot(xlabel="time [s]", ylim=(len(rows) - 0.4, -0.6))
    draw_grid(axes)
    axes.set_yticks(range(len(rows)), [shortened(row.topic) for row in rows])
    for number, row in enumerate(rows):
        _draw_topic(axes, number, row)
    margin = MARGIN * max(duration, 1e-3)
    axes.set_xlim(-margin, duration + margin)  # mounts may be stamped long before the drive
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    return Plot(as_svg(figure))


def shortened(topic: str, most: int = 36) -> str:
    """A topic's name, its middle left out where it is long."""
    return topic if len(topic) <= most else f"{topic[: most // 2 - 1]}…{topic[-most // 2 :]}"


def _draw_topic(axes: Axes, number: int, row: TimelineRow) -> None:
    timing, start = row.timing, row.zero
    if not timing.count:
        return
    begins = [timing.first, *(gap.start + gap.length for gap in timing.gaps)]
    ends = [*(gap.start for gap in timing.gaps), timing.last]
    least = 0.002 * max(timing.duration, 1e-9)  # a single message is still to be seen
    spans = [(begin - start, max(end - begin, least)) for begin, end in zip(begins, ends, strict=True)]
    axes.broken_barh(spans, (number - 0.3, 0.6), color=TRUTH if row.used else WALL, alpha=0.9 if row.used else 0.5)
    pauses = [(gap.start - start, gap.length) for gap in timing.gaps]
    axes.broken_barh(pauses, (number - 0.08, 0.16), color=FAULTY)
