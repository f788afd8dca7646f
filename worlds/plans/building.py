"""Generate buildings from a seed: corridors around two or three blocks of rooms, with loops and identical wings."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats, Span
from refseq_bench.worlds.plans.dials import AS_DRAWN, Dials
from refseq_bench.worlds.plans.furnish import (
    Character,
    Item,
    Rail,
    draw_character,
    draw_floor,
    draw_materials,
    draw_place,
    glazed_walls,
    items_on,
    lamp_rows,
    modular,
    named,
    without_overlaps,
)
from refseq_bench.worlds.plans.generate import END_MARGIN, closed_where_cramped, route_along, wall_of
from refseq_bench.worlds.plans.schema import FloorPlan, Wall

BLOCKS = (2, 3)
"""Fewest and most blocks: two make an eight, three a ladder."""
BLOCK_LENGTH, BLOCK_DEPTH = (12.0, 18.0), (9.0, 12.0)
"""Size of a block [m]: deep enough for two rooms back to back."""
ALIKE = 0.5
"""Share of wings that are as the first one is, where no dial says otherwise: a choice."""
SIDES = ("south", "east", "north", "west")


def building(seed: int, dials: Dials = AS_DRAWN) -> FloorPlan:
    """Return the building of a seed: the same seed and dials give the same plan, bit for bit.

    Corridors lead around each of its blocks, which are of one size and stand in a row. Of the wings, the corridors
    around a block, a share is identical, thing for thing. Routes: ``forward`` around all, ``reverse`` back; ``wing``
    around the first block, ``last-wing`` likewise around the last; ``detour`` as ``forward``, but across behind the
    first block.
    """
    rng = np.random.default_rng((BUILDINGS, seed))
    like = dials.turned(draw_character(rng))
    count = int(rng.integers(BLOCKS[0], BLOCKS[1] + 1))
    block = np.round([rng.uniform(*BLOCK_LENGTH), rng.uniform(*BLOCK_DEPTH)], 1)
    walls = _walls(count, block, like)
    share = ALIKE if dials.repetition is None else dials.repetition
    alike = [bool(drawn) for drawn in rng.random(count) < share]
    items = [item for w in walls[:4] for item in _on_outer(rng, like, w, float(block[0]) + like.width, alike)]
    items += _on_blocks(rng, like, walls[4:], alike, dials.repetition)
    size = np.max([w.end for w in walls], axis=0)
    plan = FloorPlan.model_validate(
        {
            "name": f"building-{seed}{dials.suffix}",
            "title": f"Building of {count} blocks, {size[0]:.0f} × {size[1]:.0f} m, made from seed {seed}",
            "place": draw_place(rng),
            "floor": draw_floor(rng),
            "ceiling": {"height": like.height, "material": "ceiling"},
            "material": draw_materials(rng),
            "wall": walls,
            **named(closed_where_cramped(items, walls, {})),
            "lamp": lamp_rows(rng, like, _legs(count, block, like.width), _by_day(count, glazed_walls(items))),
            "routes": _routes(count, block, like.width),
        }
    )
    return without_overlaps(plan)


BUILDINGS = 26
"""Keeps a building's random numbers apart from those of the corridor of its seed."""


def _walls(count: int, block: Floats, like: Character) -> list[Wall]:
    """The four outer walls, seen from within, then those of each block, seen from around it; all counter-clockwise."""
    step = block[0] + like.width
    outer = np.array([count * step + like.width, block[1] + 2 * like.width])
    thickness = 0.3 if like.glazed != "neither" else 0.15
    walls = [w.model_copy(update={"thickness": thickness}) for w in _box("", np.zeros(2), outer, "left")]
    for k in range(count):
        walls += _box(f"-{k + 1}", np.array([like.width + k * step, like.width]), block, "right")
    return walls


def _box(number: str, corner: Floats, size: Floats, inside: str) -> list[Wall]:
    corners = np.round(corner + size * np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]), 3)
    return [wall_of(f"{side}{number}", a, b, inside) for side, (a, b) in zip(SIDES, pairwise(corners), strict=True)]


def _on_outer(rng: Generator, like: Character, wall: Wall, step: float, alike: Sequence[bool]) -> list[Item]:
    """Things on an outer wall; along the row of blocks the parts of wings ``alike`` are as the first one's."""
    rail = Rail((END_MARGIN + like.width, wall.length - END_MARGIN - like.width))
    items = items_on(rng, like, wall, rail, glazed=like.glazed != "neither")
    if wall.name in ("east", "west"):
        return items
    parts = [(k * step + like.width, (k + 1) * step) for k in range(len(alike))]
    return _copied(items, parts if wall.name == "south" else parts[::-1], rail.span, alike)


def _copied(items: list[Item], parts: list[Span], whole: Span, alike: Sequence[bool]) -> list[Item]:
    """Things of the parts (from, to) of a wall, those of the first part on all that are ``alike``."""
    first = [item for item in items if parts[0][0] <= item["at"] <= parts[0][1]]
    found = list(first)
    for (low, high), same in zip(parts[1:], alike[1:], strict=True):
        own = [item for item in items if low <= item["at"] <= high]
        moved = [{**item, "at": round(item["at"] + low - parts[0][0], 2)} for item in first]
        fitting = [item for item in moved if whole[0] <= item["at"] - 1.2 and item["at"] + 1.2 <= whole[1]]
        found += fitting if same else own
    return found


def _on_blocks(
    rng: Generator, like: Character, walls: list[Wall], alike: Sequence[bool], modules: float | None
) -> list[Item]:
    """Things on the walls of the blocks: of those ``alike`` each side is as that of the first one."""
    found: list[Item] = []
    first: dict[str, list[Item]] = {}
    for wall in walls:
        side, _, number = wall.name.partition("-")
        rail = Rail((END_MARGIN, wall.length - END_MARGIN))
        items = items_on(rng, like, wall, rail, glazed=False, blank=_blank(rng, wall))
        if modules is not None:
            items = modular(rng, items, rail.span, modules)
        if side in first and alike[int(number) - 1]:
            items = [{**item, "wall": wall.name} for item in first[side]]
        first.setdefault(side, items)
        found += items
    return found


def _blank(rng: Generator, wall: Wall) -> list[Span]:
    """One wall in four has no clutter at all."""
    return [(0.0, wall.length)] if rng.random() < 0.25 else []


def _lines(count: int, block: Floats, width: float) -> tuple[list[float], tuple[float, float]]:
    """Middle lines of the corridors: x of those across, y of those along [m]."""
    across = [round(float(k * (block[0] + width) + width / 2), 3) for k in range(count + 1)]
    return across, (round(width / 2, 3), round(float(block[1] + 1.5 * width), 3))


def _legs(count: int, block: Floats, width: float) -> list[tuple[Floats, Floats]]:
    across, (south, north) = _lines(count, block, width)
    along = [(np.array([across[0], y]), np.array([across[-1], y])) for y in (south, north)]
    return along + [(np.array([x, south]), np.array([x, north])) for x in across]


def _by_day(count: int, glazed: set[str]) -> list[bool]:
    """Tell of each leg whether windows of the outer wall beside it let the day in; between blocks there are none."""
    beside = ["south", "north", "west", *[""] * (count - 1), "east"]
    return [wall in glazed for wall in beside]


def _routes(count: int, block: Floats, width: float) -> dict[str, list[list[float]]]:
    x, (south, north) = _lines(count, block, width)

    def around(*corners: tuple[float, float]) -> list[list[float]]:
        return route_along(np.array([*corners, corners[0]]))

    def ring(west: float, east: float) -> list[list[float]]:
        return around((west, south), (east, south), (east, north), (west, north))

    forward = ring(x[0], x[-1])
    detour = np.array([(x[0], south), (x[1], south), (x[1], north), (x[-1], north), (x[-1], south), (x[1], south)])
    return {
        "forward": forward,
        "reverse": forward[::-1],
        "wing": ring(x[0], x[1]),
        "last-wing": ring(x[-2], x[-1]),
        "detour": route_along(detour),
    }
