"""Plan of a mission: the true path, in a colour an order, and the points where orders began."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.plan import FloorOutline, floor_plan
from refseq_bench.scenarios.report.plots.style import DRIVE_COLOURS, FAULTY, INK, WALL, Plot, page_style, with_legend
from refseq_bench.scenarios.scoring.missions import MissionRun, MissionScore

EVERY = 0.05
"""The path is drawn at points so far from each other at least [m]."""
NAMED = 3
"""The legend names no more things that were touched, else it counts them: a choice."""


@page_style
def mission_plan(run: MissionRun, score: MissionScore, within: float, outline: FloorOutline | None) -> Plot:
    """The true path in the plan, a colour an order, numbered where an order began; crossed out where it was wrong.

    A plus stands where the robot was when it touched something first. The circle around the goal is the tolerance [m].
    """
    path, goal = _thinned(run.track[:, :3]), np.array([run.goal])
    learnt = [order.where for order in run.orders if len(order.where)]
    known = [line for line in (path[:, 1:], goal, *learnt) if np.isfinite(line).all()]
    floor = floor_plan(known, outline)
    for number, line in enumerate(learnt):
        floor.axes.plot(*line.T, color=WALL, linewidth=3.5, alpha=0.3, label=None if number else "as learnt")
    _draw_path(floor.axes, run, path)
    _draw_begins(floor.axes, run, score.wrong)
    _draw_touches(floor.axes, run)
    _draw_goal(floor.axes, run, within)
    floor.frame(np.maximum(floor.size, 1.0) * (0.03, 0.12))
    return with_legend(floor.figure, "The axes have different scales." if floor.stretched else "")


def _thinned(track: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times and positions, where the robot has moved on."""
    kept, last = [0], track[0, 1:]
    for number, place in enumerate(track[:, 1:]):
        if np.hypot(*(place - last)) >= EVERY:
            kept.append(number)
            last = place
    return track[[*kept, len(track) - 1]]


def _draw_path(axes: Axes, run: MissionRun, path: NDArray[np.float64]) -> None:
    """From one switch to the next in a colour; what was driven before the first is drawn with it."""
    begins = [time for _, time in run.switches]
    parts = np.searchsorted(begins, path[:, 0], side="right") - 1
    for part, number in enumerate(dict.fromkeys(np.maximum(parts, 0).tolist())):
        inside = np.flatnonzero(np.maximum(parts, 0) == number)
        line = path[inside[0] : inside[-1] + 2, 1:]
        label = run.orders[run.switches[number][0]].behaviour if run.switches else "stood"
        colour = DRIVE_COLOURS[part % len(DRIVE_COLOURS)]
        axes.plot(*line.T, color=colour, linewidth=1.8, label=f"{number + 1}: {label}")


def _draw_begins(axes: Axes, run: MissionRun, wrong: Sequence[bool] | None) -> None:
    """Numbers of the switches, where they were; an order that is begun again right there is named with the first."""
    told: list[tuple[NDArray[np.float64], str]] = []
    for number, (_, time) in enumerate(run.switches):
        place = run.position(time)
        bad = wrong is not None and wrong[number]
        axes.plot(*place, "X" if bad else "o", color=FAULTY if bad else INK, markersize=8 if bad else 4)
        if told and np.hypot(*(told[-1][0] - place)) < 0.3:
            told[-1] = told[-1][0], f"{told[-1][1]}, {number + 1}"
        else:
            told.append((place, str(number + 1)))
    for place, text in told:
        axes.annotate(text, (place[0], place[1]), xytext=(5, 5), textcoords="offset points", color=INK, fontsize=8)


def _draw_touches(axes: Axes, run: MissionRun) -> None:
    if not run.touches:
        return
    places = np.array([run.position(touch.time) for touch in run.touches])
    things = ", ".join(run.touched) if len(run.touches) <= NAMED else f"{len(run.touches)} things"
    axes.plot(*places.T, "P", color=FAULTY, markersize=8, label=f"touches {things}")


def _draw_goal(axes: Axes, run: MissionRun, within: float) -> None:
    end = run.track[-1, 1:3]
    axes.plot(*end, "s", color=INK, markerfacecolor="none", markersize=9, label="end")
    if not math.isnan(run.goal[0]):
        axes.plot(*run.goal, "*", color=INK, markersize=10, label="goal")
        axes.add_patch(Circle(run.goal, within, fill=False, edgecolor=INK, linewidth=0.6, linestyle=":"))
