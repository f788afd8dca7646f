"""Image light of a camera: the light around it less that of its spot lights.

A renderer has one light that comes from all sides, the same at every place of a picture. Here it is the mean over the
six directions of the axes of all light but the direct sun (``refseq_bench.worlds.meter``), less what the picture's
spots give there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import ArrayLike

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.form_factors import SKIN, Cards
from refseq_bench.worlds.lighting.photometry import Spot, spot_illuminance
from refseq_bench.worlds.plans.areas import Rectangle, rectangles
from refseq_bench.worlds.plans.schema import FloorPlan

AXES = np.array([axis * sign for axis in np.eye(3) for sign in (1.0, -1.0)])
"""The six directions that are asked, (6, 3): +x −x +y −y +z −z."""
EYE = 1.0
"""Height above the floor at which it is asked [m]; a choice: the robots' cameras are about there."""
STEP = 1.2
"""Longest side of a cell of the grid [m]; a choice."""
CLEARANCE = 0.3
"""The grid keeps so far from the walls [m]: no camera gets nearer, and right at a window a spot is no window."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Illuminances ``lux`` (m, n) [lx] at equal steps over a rectangle."""

    area: Rectangle
    lux: Floats

    def at(self, point: Floats) -> float:
        """Interpolate linearly both ways at ``point`` (2,); outside the rectangle its edge counts."""
        last = np.array(self.lux.shape) - 1
        place = np.clip((point - self.area.low) / self.area.size, 0.0, 1.0) * last
        cell = np.minimum(place.astype(int), last - 1)
        (u, v), (i, j) = place - cell, cell
        corners = self.lux[i : i + 2, j : j + 2]
        return float(np.array([1.0 - u, u]) @ corners @ np.array([1.0 - v, v]))


class Ambient:
    """Light from all sides, by place; ``solve`` works out its grids when it is asked for the first time."""

    def __init__(self, solve: Callable[[], tuple[Grid, ...]]) -> None:
        self._solve = solve

    @classmethod
    def even(cls, lux: float) -> "Ambient":
        """Return one that is the same everywhere."""
        return cls(lambda: (Grid(Rectangle(np.zeros(2), np.ones(2)), np.full((2, 2), lux)),))

    @cached_property
    def grids(self) -> tuple[Grid, ...]:
        """The illuminances over all the ground."""
        return self._solve()

    def at(self, point: ArrayLike) -> float:
        """Illuminance that the image light should give [lx] for a camera at ``point``, (2,) or (3,) [m]."""
        place = np.asarray(point, dtype=float)[:2]
        return min(self.grids, key=lambda grid: _distance(grid.area, place)).at(place)


Measure = Callable[[Cards], Floats]
"""All light but the direct sun on cards, (m,) [lx], as ``Meter.for_camera`` gives it."""


def ambient(plan: FloorPlan, measure: Measure, spots: tuple[Spot, ...]) -> Ambient:
    """Measure the image light over all the ground between the walls, when it is asked for."""
    return Ambient(partial(_measured, plan, measure, spots))


def _measured(plan: FloorPlan, measure: Measure, spots: tuple[Spot, ...]) -> tuple[Grid, ...]:
    areas = rectangles(plan)
    nodes = [_nodes(_within(areas, area)) for area in areas]
    lux = left_over(measure, spots, np.concatenate([points.reshape(-1, 3) for _, points in nodes]))
    ends = np.cumsum([points.shape[0] * points.shape[1] for _, points in nodes])[:-1]
    parts = np.split(lux, ends)
    return tuple(Grid(area, part.reshape(points.shape[:2])) for (area, points), part in zip(nodes, parts, strict=True))


def left_over(measure: Measure, spots: tuple[Spot, ...], points: Floats) -> Floats:
    """Return what the spots leave out at ``points`` (m, 3) [m], the mean over the six axes, (m,) [lx], not below 0."""
    cards = Cards(np.repeat(points, len(AXES), axis=0), np.tile(AXES, (len(points), 1)))
    around = measure(cards).reshape(len(points), len(AXES)).mean(axis=1)
    rendered = sum(np.abs(spot_illuminance(spot, points)).sum(axis=1) for spot in spots) / len(AXES)
    return np.maximum(0.0, around - rendered)


def _within(areas: tuple[Rectangle, ...], area: Rectangle) -> Rectangle:
    """Shrink a rectangle of the ground by ``CLEARANCE`` at its walls, not where it goes on in the next one."""
    low, high = area.low.copy(), area.high.copy()
    for axis in range(2):
        for side, sign in ((low, 1.0), (high, -1.0)):
            beyond = area.middle
            beyond[axis] = side[axis] - sign * SKIN
            if not any(other.holds(beyond) for other in areas):
                side[axis] += sign * min(CLEARANCE, area.size[axis] / 4)
    return Rectangle(low, high)


def _nodes(area: Rectangle) -> tuple[Rectangle, Floats]:
    """A rectangle and the nodes of its grid, (m, n, 3), at least two each way."""
    counts = np.maximum(1, np.ceil(area.size / STEP).astype(int)) + 1
    x, y = (np.linspace(a, b, n) for a, b, n in zip(area.low, area.high, counts, strict=True))
    return area, np.stack([*np.meshgrid(x, y, indexing="ij"), np.full(counts, EYE)], axis=-1)


def _distance(area: Rectangle, point: Floats) -> float:
    beyond = np.maximum(0.0, np.maximum(area.low - point, point - area.high))
    return float(np.hypot(*beyond))
