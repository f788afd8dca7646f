"""Routes on a plan's drawing: lines side by side, with arrows and distances."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.drawing.style import ROUTES, Dashes, arrow, label, line
from refseq_bench.worlds.plans.schema import FloorPlan

MARK = 10.0
"""A route is marked every so many metres."""
ASIDE = 0.16
"""Routes lie so far, or a multiple, to the right of the line that they follow [m]: there and back lie side by side."""


def draw_routes(axes: Axes, plan: FloorPlan, names: Sequence[str]) -> None:
    """Draw the named routes side by side."""
    for i, name in enumerate(names):
        _route(axes, plan, name, ASIDE * (1 + i / 2), *ROUTES[i % len(ROUTES)])


def _route(axes: Axes, plan: FloorPlan, name: str, aside: float, colour: str, dashes: Dashes) -> None:
    """A line to the right of the route, with an arrow and the distance every ``MARK`` metres."""
    points = np.array(plan.routes[name])
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = steps / lengths[:, None]
    right = np.stack([along[:, 1], -along[:, 0]], axis=1) * aside
    line(axes, _beside(points, right), color=colour, linestyle=dashes, linewidth=0.9, zorder=5.0, gid=f"route_{name}")
    behind = np.concatenate([[0.0], np.cumsum(lengths)])
    for distance in np.arange(0.0, behind[-1] + 1e-9, MARK):
        k = min(int(np.searchsorted(behind, distance, side="right")) - 1, len(lengths) - 1)
        at = points[k] + (distance - behind[k]) * along[k] + right[k]
        _mark(axes, at, along[k], right[k], f"{distance:g}", colour)


def _beside(points: Floats, right: Floats) -> list[Floats]:
    """The line of points moved aside by each leg's vector; where it turns back it goes across."""
    moved = [points[0] + right[0]]
    for point, before, after in zip(points[1:-1], right[:-1], right[1:], strict=True):
        both = before @ before + before @ after
        if both > 0.1 * (before @ before):
            moved.append(point + (before + after) * (before @ before) / both)
        else:
            moved += [point + before, point + after]
    return [*moved, points[-1] + right[-1]]


def _mark(axes: Axes, at: Floats, along: Floats, right: Floats, text: str, colour: str) -> None:
    arrow(axes, at + 0.5 * along, at - 0.05 * along, colour, zorder=5.1)
    label(axes, at + 0.2 * right / np.linalg.norm(right), text, color=colour, clip_on=True, zorder=6)
