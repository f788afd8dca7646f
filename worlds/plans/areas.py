"""Ground area between the walls of a plan, as rectangles.

Walls that run along x and y and leave no gap enclose a polygon, maybe with courtyards; it is cut into rectangles at the
walls' own coordinates. Around any other walls it is the smallest rectangle.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.schema import FloorPlan, Wall


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Corners ``low`` and ``high``, (2,) each [m]."""

    low: Floats
    high: Floats

    @property
    def size(self) -> Floats:
        """Lengths of the sides, (2,) [m]."""
        return self.high - self.low

    @property
    def middle(self) -> Floats:
        """Its centre, (2,) [m]."""
        return (self.low + self.high) / 2

    def holds(self, point: Sequence[float] | Floats) -> bool:
        """Tell whether ``point`` (2,) lies in it or on its edge."""
        x, y = point
        return bool(self.low[0] <= x <= self.high[0] and self.low[1] <= y <= self.high[1])


def rectangles(plan: FloorPlan) -> tuple[Rectangle, ...]:
    """Cut the ground between the walls into rectangles that touch and do not overlap."""
    walls = enclosing(plan)
    if plan.ceiling is None or not walls:
        return (Rectangle(*plan.bounds),)
    ends = np.array([(w.start, w.end) for w in walls])  # (n, 2 ends, 2)
    xs, ys = np.unique(ends[..., 0]), np.unique(ends[..., 1])
    upright = ends[ends[:, 0, 0] == ends[:, 1, 0]]
    return tuple(
        Rectangle(np.array([x0, y0]), np.array([x1, y1]))
        for y0, y1 in pairwise(ys)
        for x0, x1 in _runs(pairwise(xs), upright, (y0 + y1) / 2)
    )


def _runs(columns: Iterable[tuple[float, float]], upright: Floats, y: float) -> list[tuple[float, float]]:
    """Spans along x at the height ``y`` that lie inside: neighbouring columns are joined."""
    low, high = np.sort(upright[..., 1], axis=1).T
    crossed = upright[(low < y) & (y < high), 0, 0]
    runs: list[tuple[float, float]] = []
    for x0, x1 in columns:
        if np.sum(crossed < (x0 + x1) / 2) % 2 == 0:
            continue
        joins = runs and runs[-1][1] == x0
        runs[-1:] = [(runs[-1][0], x1)] if joins else [*runs[-1:], (x0, x1)]
    return runs


def enclosing(plan: FloorPlan) -> tuple[Wall, ...]:
    """Return the walls that close the area off, up to the ceiling; none where they leave a gap or run askew."""
    walls = tuple(w for w in plan.wall if w.height is None)
    corners = Counter(corner for wall in walls for corner in (wall.start, wall.end))
    straight = all(0.0 in np.subtract(w.end, w.start) for w in walls)
    return walls if straight and all(count == 2 for count in corners.values()) else ()


def inside(plan: FloorPlan, point: Sequence[float] | Floats) -> bool:
    """Tell whether ``point`` (2,) lies on the ground between the walls."""
    return any(r.holds(point) for r in rectangles(plan))
