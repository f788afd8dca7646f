"""Picture of behaviours that a robot ran: its true path on the plan."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from refseq.planar import Pose, in_world
from refseq_bench import robots
from refseq_bench.robots.robot import Shape
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.robot_checks.behaviour_drive import BehaviourDrive, BehaviourResult
from refseq_bench.worlds.drawing.outline import outline_of
from refseq_bench.worlds.plans.load import load_plan

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""One for each behaviour, again and again (Okabe and Ito)."""
AROUND = 2.5
"""So much is drawn around the path [m]."""
OUTLINES = 1.0
"""The robot's outline is drawn every so many metres of its way."""


def behaviour_plan(asked: BehaviourDrive, found: Sequence[BehaviourResult]) -> Figure:
    """Draw the true path on the plan, a colour for each behaviour, with the robot's outline on the way."""
    plan, shape = load_plan(asked.world), robots.load(asked.robot).shape
    points = np.vstack([done.path[:, :2] for done in found])
    low, high = points.min(axis=0) - AROUND, points.max(axis=0) + AROUND
    width, height = high - low
    scale = min(12.0 / width, 8.0 / height)
    with mpl.rc_context({**AS_WRITTEN, "font.size": 9, "svg.fonttype": "none"}):
        figure = Figure(figsize=(scale * width + 1.0, scale * height + 1.2), dpi=100, layout="constrained")
        axes = figure.add_subplot(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        for line in outline_of(plan):
            axes.plot(*line.T, color="#222222", lw=1.0, zorder=2)
        for i, done in enumerate(found):
            _draw_path(axes, done, shape, COLOURS[i % len(COLOURS)])
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.set_title(f"{asked.robot} in {asked.world}")
        figure.legend(loc="outside lower center", ncols=min(len(found), 3), frameon=False)
    return figure


def _draw_path(axes: Axes, done: BehaviourResult, shape: Shape, colour: str) -> None:
    told = f"{done.text}: {done.outcome.value}, {done.time:.0f} s, {done.way:.1f} m"
    axes.plot(done.path[:, 0], done.path[:, 1], color=colour, lw=1.8, zorder=4, label=told)
    steps = np.hypot(*np.diff(done.path[:, :2], axis=0).T)
    marks = np.searchsorted(np.cumsum(steps), np.arange(0.0, done.way, OUTLINES))
    for index in (*marks, len(done.path) - 1):
        last = index == len(done.path) - 1
        corners, alpha, width = _footprint(done.path[index], shape), 0.35 if last else None, 1.0 if last else 0.4
        axes.add_patch(Polygon(corners, color=colour, fill=last, alpha=alpha, lw=width, zorder=3))


def _footprint(pose: NDArray[np.float64], shape: Shape) -> NDArray[np.float64]:
    """Corners of the robot at a pose, with a nose ahead, (5, 2) [m]."""
    side, ahead = shape.half_width, shape.ahead
    corners = np.array(
        [[-shape.behind, -side], [0.6 * ahead, -side], [ahead, 0], [0.6 * ahead, side], [-shape.behind, side]]
    )
    return in_world(corners, Pose(*pose))
