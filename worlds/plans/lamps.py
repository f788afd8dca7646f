"""Rules that the lamps of a plan keep: they hang from a ceiling, between the walls, and not in each other."""

import math
from collections.abc import Iterator
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.areas import Rectangle, rectangles, valid_areas
from refseq_bench.worlds.plans.footprints import Footprint, against, corners, gaps
from refseq_bench.worlds.plans.schema import FloorPlan, LampRow

SIZES = (0.02, 20.0)
"""Least and most length of a lamp's sides [m]: a size beyond them was meant in other units. A choice."""
SLACK = 0.01
"""Lamps may reach so far into a wall or another lamp [m]: what is drawn to the centimetre may be off by one."""
ROUNDING = 1e-9
"""Sums of metres may be off by this [m]."""


class _Lamp(NamedTuple):
    """One lamp of a row: its ``key`` and ``number`` in the row, where its centre is, and half its sides, (2,) [m]."""

    key: str
    row: LampRow
    number: int
    at: Floats
    half: Floats

    def __str__(self) -> str:
        return f"{self.key}, lamp {self.number} of its row: '{self.row.name}', {_size(self.row)}, "


def misplaced_lamps(plan: FloorPlan) -> Iterator[str]:
    """Find lamps without a ceiling or of another unit, those of a row that hang in each other, and misplaced posts."""
    for i, row in enumerate(plan.lamp):
        if plan.ceiling is None:
            yield f"lamp[{i}]: '{row.name}' hangs from a ceiling, and the plan has none; valid is a [[post]]"
        yield from _out_of_scale(f"lamp[{i}]", row)
        yield from _crowded(f"lamp[{i}]", row)
    for i, post in enumerate(plan.post):
        if plan.ceiling is not None:
            yield f"post[{i}]: '{post.name}' lights streets, and the plan has a ceiling; valid is a [[lamp]]"


def overreaching_lamps(plan: FloorPlan) -> Iterator[str]:
    """Find lamps that reach outside the walls, into one, or into lamps of another row, one line each."""
    lamps = [
        _Lamp(f"lamp[{i}]", row, number, at, np.array(row.size) / 2)
        for i, row in enumerate(plan.lamp)
        for number, at in enumerate(row.positions, 1)
    ]
    if lamps:
        yield from _beyond_the_walls(lamps, rectangles(plan))
        yield from _in_walls(lamps, plan)
        yield from _in_each_other(lamps)


def _size(row: LampRow) -> str:
    return f"{row.size[0]:g} by {row.size[1]:g} m"


def _metres(point: Floats) -> str:
    return f"[{point[0]:.2f}, {point[1]:.2f}]"


def _out_of_scale(key: str, row: LampRow) -> Iterator[str]:
    least, most = SIZES
    for side, length in enumerate(row.size):
        if not least <= length <= most:
            given = f"{key}.size[{side}]: {length:g} of '{row.name}' is not valid"
            yield f"{given}; it should be metres, from {least:g} to {most:g}"


def _crowded(key: str, row: LampRow) -> Iterator[str]:
    """Find a row whose lamps hang in each other."""
    (x, y), step = row.size, np.abs(row.step)
    if row.count > 1 and (math.hypot(*step) < SLACK or np.all(step < np.array(row.size) - SLACK - ROUNDING)):
        given = f"{key}.step: {list(row.step)} of '{row.name}' is not valid; {row.count} lamps would hang in each other"
        yield f"{given}; valid is {x:g} m along x or {y:g} m along y at least"


def _beyond_the_walls(lamps: list[_Lamp], areas: tuple[Rectangle, ...]) -> Iterator[str]:
    """Find lamps that the areas between the walls do not hold, and tell where they leave them."""
    spans = np.array([(lamp.at - lamp.half, lamp.at + lamp.half) for lamp in lamps])
    lows, highs = np.array([area.low for area in areas]) - SLACK, np.array([area.high for area in areas]) + SLACK
    low, high = spans[:, 0, None], spans[:, 1, None]
    held = np.any(np.all((lows <= low + ROUNDING) & (high <= highs + ROUNDING), axis=2), axis=1)
    for k in np.flatnonzero(~held).tolist():
        lamp = lamps[k]
        if out := _uncovered(lamp, areas):
            farthest = max(out, key=lambda point: math.dist(point, lamp.at))
            near = sorted(areas, key=lambda area: not area.holds(lamp.at))
            yield f"{lamp}reaches to {_metres(farthest)}, outside the walls; {valid_areas(tuple(near))}"


def _uncovered(lamp: _Lamp, areas: tuple[Rectangle, ...]) -> list[Floats]:
    """Corners of the parts of a lamp that no area holds, (2,) each [m], but for those no wider than ``SLACK``.

    The lamp is cut at the sides of all areas: each part lies in one of them, or outside.
    """
    low, high = lamp.at - lamp.half, lamp.at + lamp.half
    sides = np.clip([low, high, *(side for area in areas for side in (area.low, area.high))], low, high)
    parts = [np.array(part) for part in product(pairwise(np.unique(sides[:, 0])), pairwise(np.unique(sides[:, 1])))]
    wide = [part for part in parts if np.diff(part).min() > SLACK + ROUNDING]
    out = [part for part in wide if not any(area.holds(part.mean(axis=1)) for area in areas)]
    return [np.array(corner) for part in out for corner in product(*part)]


def _in_walls(lamps: list[_Lamp], plan: FloorPlan) -> Iterator[str]:
    """Find lamps that reach into a wall up to the ceiling, such as a partition between rooms."""
    walls = plan.full_walls
    solids = [against(plan, wall.name, (0.0, wall.length), (-wall.thickness, 0.0)) for wall in walls]
    boxes = np.array([corners(solid) for solid in solids]).reshape(-1, 4, 2)
    low, high = boxes.min(axis=1) - ROUNDING, boxes.max(axis=1) + ROUNDING
    for lamp in lamps:
        half = np.maximum(lamp.half - SLACK, 0.0)
        # Most lamps are far from every wall, which their bounding boxes tell sooner.
        near = np.flatnonzero(np.all((low <= lamp.at + half) & (lamp.at - half <= high), axis=1)).tolist()
        (x, y), (length, width) = lamp.at, half
        gap = gaps(Footprint(x, y, 0.0, length, width), [solids[k] for k in near])
        if gap.min(initial=np.inf) <= 0.0:
            yield f"{lamp}at {_metres(lamp.at)} reaches into wall '{walls[near[int(np.argmin(gap))]].name}'; move it"


def _in_each_other(lamps: list[_Lamp]) -> Iterator[str]:
    """Find lamps that overlap those of a row before theirs."""
    places, halves = np.array([lamp.at for lamp in lamps]), np.array([lamp.half for lamp in lamps])
    begun = 0
    for k, lamp in enumerate(lamps):
        begun = k if lamp.number == 1 else begun
        apart = lamp.half + halves[:begun]
        deep = np.min(apart - np.abs(lamp.at - places[:begun]), axis=1)
        if begun and deep.max() > SLACK + ROUNDING:
            other, (x, y) = lamps[int(np.argmax(deep))], apart[int(np.argmax(deep))]
            where = f"lamp {other.number} of '{other.row.name}' at {_metres(other.at)}"
            yield (
                f"{lamp}at {_metres(lamp.at)} overlaps {where} by {deep.max():.2f} m; their centres should be {x:g} m "
                f"apart along x or {y:g} m along y"
            )
