"""Ground area between the walls of a plan, as rectangles.

Walls that run along x and y and leave no gap enclose a polygon, maybe with courtyards; it is cut into rectangles at the
walls' own coordinates. Partitions may stand in it. Around any other walls it is the smallest rectangle.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.schema import FloorPlan, Point, Wall

JOINED = 0.01
"""Ends of walls that are no farther apart along x and y [m] meet: what is drawn to the centimetre may be off by one."""


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
    ring = _ring_of(plan) if plan.ceiling is not None else None
    return (Rectangle(*plan.bounds),) if ring is None else _cut(ring.ends)


def _cut(ends: Floats) -> tuple[Rectangle, ...]:
    """Rectangles between walls from end to end, (n, 2 ends, 2), along x and y."""
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


class _Ring(NamedTuple):
    """Walls that close an area off, and their ``ends`` (n, 2 ends, 2) [m] where two of them meet in each corner."""

    walls: tuple[Wall, ...]
    ends: Floats


def enclosing(plan: FloorPlan) -> tuple[Wall, ...]:
    """Return the walls that close the area off, up to the ceiling; none where they leave a gap or run askew."""
    ring = _ring_of(plan)
    return () if ring is None else ring.walls


def _ring_of(plan: FloorPlan) -> _Ring | None:
    """The walls around the area: as they are drawn, or else where ends that are nearly the same are taken for one."""
    walls = plan.full_walls
    if not walls:
        return None
    drawn = np.array([(wall.start, wall.end) for wall in walls])
    return _closed(walls, drawn) or _closed(walls, _snapped(drawn))


def _closed(walls: tuple[Wall, ...], ends: Floats) -> _Ring | None:
    """The walls that meet others at both ends, if they close an area off in which the others stand as partitions."""
    kept, crowd = _linked(ends)
    ring = ends[kept]
    straight = np.any(ring[:, 0] == ring[:, 1], axis=1)
    if not kept or crowd or not straight.all():
        return None
    if len(kept) < len(walls) and not _within(ring, np.delete(ends, kept, axis=0).reshape(-1, 2)):
        return None
    return _Ring(tuple(walls[i] for i in kept), ring)


def _within(ring: Floats, points: Floats) -> bool:
    """Tell whether all points (n, 2) lie in the area of a ring of walls, (m, 2 ends, 2), or at its edge."""
    grown = [Rectangle(area.low - JOINED, area.high + JOINED) for area in _cut(ring)]
    return all(any(area.holds(point) for area in grown) for point in points)


def _linked(ends: Floats) -> tuple[list[int], list[Point]]:
    """Numbers of the walls left when those with a free end are gone, one after another; corners of more than two."""
    corners = [((x0, y0), (x1, y1)) for (x0, y0), (x1, y1) in ends.tolist()]
    kept = list(range(len(corners)))
    while True:
        meeting = Counter(corner for i in kept for corner in corners[i])
        linked = [i for i in kept if all(meeting[corner] > 1 for corner in corners[i])]
        if linked == kept:
            return kept, [corner for corner, count in meeting.items() if count > 2]
        kept = linked


def crowded_corners(plan: FloorPlan) -> list[Point]:
    """Return the corners in which more than two walls up to the ceiling meet: which of them enclose is not told."""
    walls = [(wall.start, wall.end) for wall in plan.full_walls]
    return _linked(_snapped(np.array(walls)))[1] if walls else []


def _snapped(ends: Floats) -> Floats:
    """Ends of walls, (n, 2 ends, 2), whose coordinates are one where they are nearly the same."""
    return np.stack([_merged(ends[..., 0]), _merged(ends[..., 1])], axis=-1)


def _merged(values: Floats) -> Floats:
    """Values in which each that is no more than ``JOINED`` above a lesser one is that one."""
    levels: list[float] = []
    for value in np.unique(values).tolist():
        if not levels or value > levels[-1] + JOINED + 1e-9:
            levels.append(value)
    return np.array(levels)[np.searchsorted(levels, values, side="right") - 1]


def inside(plan: FloorPlan, point: Sequence[float] | Floats) -> bool:
    """Tell whether ``point`` (2,) lies on the ground between the walls."""
    return any(r.holds(point) for r in rectangles(plan))


def valid_areas(areas: tuple[Rectangle, ...]) -> str:
    """Return the spans of some areas as they are told in errors."""
    spans = [f"x {r.low[0]:g} to {r.high[0]:g}, y {r.low[1]:g} to {r.high[1]:g}" for r in areas[:4]]
    return f"valid is {'; or '.join(spans)}{'; …' if len(areas) > 4 else ''}"
