"""Rules that a floor plan keeps beyond its schema: its parts fit together, and each broken rule is one line."""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, time
from itertools import combinations, pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.plans.areas import enclosing, rectangles, valid_areas
from refseq_bench.worlds.plans.footprints import PERSON_RADIUS, gaps, taken, ways
from refseq_bench.worlds.plans.frame import LocalFrame, left_of
from refseq_bench.worlds.plans.lamps import misplaced_lamps, overreaching_lamps
from refseq_bench.worlds.plans.schema import (
    LINES,
    ON_WALL,
    SMALLEST,
    STANDING,
    TABLES,
    Door,
    FloorPlan,
    OnWall,
    Point,
    Wall,
    Window,
)

LONGEST_WALL = 500.0
"""Longest wall [m]: the light that a world's surfaces throw on each other is worked out by patches, all with all."""


FLAT = 1e-9
"""Two walls that span a smaller area between them [m²] are taken for parallel."""
SAME = 1e-6
"""Points of a line that are nearer to each other [m] are one, and have no direction between them."""
SMALLEST_SIDE = 0.01
"""Least width and height of what hangs on a wall [m]: a smaller measure was meant in other units."""
SCALES: Mapping[str, Mapping[str, tuple[float, float]]] = MappingProxyType(
    {
        "floor": {"tile": (0.01, 20.0)},
        "ceiling": {"panel": (0.05, 20.0)},
        "wall": {"thickness": (0.01, 5.0)},
        "door": {"width": (0.3, 20.0), "height": (0.3, 20.0), "depth": (0.1, 50.0)},
    }
)
"""Least and most of a table's measures [m]."""
BESIDE = 0.01
"""So far from a wall's face one stands on one side of it [m]."""
HIGHEST_CEILING = 50.0
"""A hall is no higher [m]: a height beyond it was meant in other units."""


def checked(plan: FloorPlan, file: str) -> FloorPlan:
    """Return the plan if all in it fits together; raises ``PlanError`` with its first mistake, as one of ``file``."""
    for mistake in _mistakes(plan):
        raise PlanError(f"{file}: {mistake}")
    return plan


def short(value: Any) -> str:
    """Return a value as errors quote it: on one line, at most 60 characters."""
    text = value.isoformat() if isinstance(value, date | time) else repr(value).replace("\n", " ")
    return text if len(text) <= 60 else text[:57] + "..."


def _mistakes(plan: FloorPlan) -> Iterator[str]:
    yield from _repeated_names(plan)
    yield from _out_of_scale(plan)
    yield from _unknown_materials(plan)
    yield from _without_bounds(plan)
    yield from _flat_walls(plan)
    yield from _wrong_heights(plan)
    yield from _crossing_walls(plan)
    yield from _turned_round(plan)
    for key, item in _listed(plan, ON_WALL):
        yield from _too_small(key, item)
        yield from _off_its_wall(plan, key, item)
    yield from _windows_inside(plan)
    yield from _overlaps(plan)
    yield from _no_ways(plan)
    yield from misplaced_lamps(plan)
    yield from _outside(plan)
    yield from overreaching_lamps(plan)
    yield from _misfit_furniture(plan)
    yield from _hemmed_in(plan)


def _listed(plan: FloorPlan, tables: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    for table in tables:
        for i, item in enumerate(getattr(plan, table)):
            yield f"{table}[{i}]", item


def _repeated_names(plan: FloorPlan) -> Iterator[str]:
    for table in TABLES:
        seen: set[str] = set()
        for i, item in enumerate(getattr(plan, table)):
            if item.name in seen:
                yield f"{table}[{i}].name: '{item.name}' is already taken; every {table} needs its own name"
            seen.add(item.name)


def _out_of_scale(plan: FloorPlan) -> Iterator[str]:
    """Find measures that nobody builds: they were meant in other units."""
    tables = (("floor", plan.floor), ("ceiling", plan.ceiling), *_listed(plan, TABLES))
    for key, item in tables:
        for name, (least, most) in SCALES.get(key.partition("[")[0], {}).items():
            if item is not None and not least <= getattr(item, name) <= most:
                given = f"{key}.{name}: {getattr(item, name):g} is not valid"
                yield f"{given}; it should be metres, from {least:g} to {most:g}"


def _unknown_materials(plan: FloorPlan) -> Iterator[str]:
    known = ", ".join(plan.material)
    users = [("floor", plan.floor), ("ceiling", plan.ceiling), *_listed(plan, ("wall", *ON_WALL, *STANDING, *LINES))]
    for key, item in users:
        name = getattr(item, "material", None)
        if name is not None and name not in plan.material:
            yield f"{key}.material: unknown material '{name}'; known are {known}"


def _flat_walls(plan: FloorPlan) -> Iterator[str]:
    for i, wall in enumerate(plan.wall):
        if wall.length < 0.1:
            yield f"wall[{i}].end: wall '{wall.name}' is {wall.length:g} m long; it should be at least 0.1 m"
        if wall.length > LONGEST_WALL:
            long = f"wall[{i}].end: wall '{wall.name}' is {wall.length:g} m long"
            yield f"{long}; it should be at most {LONGEST_WALL:g} m"


def _without_bounds(plan: FloorPlan) -> Iterator[str]:
    if plan.ceiling is None and plan.floor.area is None:
        yield "floor.area: missing; a plan without a ceiling needs the corners of its ground, [[x, y], [x, y]]"
    elif plan.ceiling is not None and plan.floor.area is not None:
        yield f"floor.area: {short(plan.floor.area)} is not valid; under a ceiling the walls tell where the floor ends"
    elif plan.ceiling is not None and not plan.wall:
        yield "wall: missing; a plan with a ceiling needs at least one wall"
    elif not all(np.less(*plan.bounds)):
        yield f"floor.area: {short(plan.floor.area)} is not valid; it should be two opposite corners"


def _crossing_walls(plan: FloorPlan) -> Iterator[str]:
    """Find walls up to the ceiling that go through each other, as those of rooms do that are laid over each other."""
    walls = [(i, wall) for i, wall in enumerate(plan.wall) if wall.height is None and plan.ceiling is not None]
    for (_, wall), (i, other) in combinations(walls, 2):
        at = _crossing(wall, other)
        if at is not None:
            yield (
                f"wall[{i}]: wall '{other.name}' goes through wall '{wall.name}' at {at}; valid are walls that meet at "
                "their ends: an outline about rooms that overlap"
            )


def _crossing(one: Wall, other: Wall) -> list[float] | None:
    """Where two walls cross, farther than ``BESIDE`` from the ends of both; None where they do not."""
    way, across, between = (
        np.subtract(one.end, one.start),
        np.subtract(other.end, other.start),
        np.subtract(other.start, one.start),
    )
    if abs(area := float(np.linalg.det([way, across]))) < FLAT:
        return None
    shares = np.linalg.det([between, across]) / area, np.linalg.det([between, way]) / area
    for share, wall in zip(shares, (one, other), strict=True):
        if not BESIDE < share * wall.length < wall.length - BESIDE:
            return None
    return [round(float(value), 2) for value in np.add(one.start, shares[0] * way)]


def _no_ways(plan: FloorPlan) -> Iterator[str]:
    """Find routes along which nobody comes anywhere, and a plan that has none."""
    if not plan.routes:
        yield "routes: it holds none; valid is one at least, as forward = [[x, y], [x, y]]"
    for name, points in plan.routes.items():
        yield from _stays(f"routes.{name}", points, BESIDE)
    for key, line in _listed(plan, LINES):
        yield from _stays(f"{key}.points", line.points, SAME)


def _stays(key: str, points: Sequence[Point], least: float) -> Iterator[str]:
    """Find points of a line that are nearer than ``least`` [m] to the one before."""
    for i, (before, point) in enumerate(pairwise(points), 1):
        if math.dist(before, point) < least:
            yield f"{key}[{i}]: {list(point)} is the point before it; valid are points apart"


def _turned_round(plan: FloorPlan) -> Iterator[str]:
    """Find walls around the floor whose inner face looks out of the building: what hangs there nobody would see."""
    areas = rectangles(plan)
    for wall in (enclosing(plan) or plan.wall) if plan.ceiling is not None else ():
        left = left_of(np.subtract(wall.end, wall.start) / wall.length)
        beside = np.add(wall.start, wall.end) / 2 + BESIDE * (left if wall.inside == "left" else -left)
        if not any(area.holds(beside) for area in areas):
            other = "right" if wall.inside == "left" else "left"
            key = f"wall[{plan.wall.index(wall)}].inside"
            yield f"{key}: {wall.inside!r} of wall '{wall.name}' is outside the building; valid is {other!r}"


def _wrong_heights(plan: FloorPlan) -> Iterator[str]:
    if plan.ceiling is not None and plan.ceiling.height > HIGHEST_CEILING:
        yield f"ceiling.height: {plan.ceiling.height:g} is not valid; it should be metres, at most {HIGHEST_CEILING:g}"
    for i, wall in enumerate(plan.wall):
        if plan.ceiling is None and wall.height is None:
            yield f"wall[{i}].height: missing; in the open air every wall needs one"
        if plan.ceiling is not None and wall.height is not None and wall.height >= plan.ceiling.height:
            yield (
                f"wall[{i}].height: {wall.height:g} is not valid; the ceiling is {plan.ceiling.height:g} m high: leave "
                "the height out"
            )
    for i, tree in enumerate(plan.tree):
        if tree.crown >= tree.height:
            high = f"the tree's height, {tree.height:g}"
            yield f"tree[{i}].crown: {tree.crown:g} is not valid; it should be less than {high}"
        if plan.ceiling is not None and tree.height > plan.ceiling.height:
            yield f"tree[{i}].height: {tree.height:g} is not valid; the ceiling is {plan.ceiling.height:g} m high"
    for i, flight in enumerate(plan.stairs):
        top = flight.steps * flight.rise
        if plan.ceiling is not None and top > plan.ceiling.height:
            yield (
                f"stairs[{i}].steps: {flight.steps} is not valid; they rise {top:g} m, and the ceiling is "
                f"{plan.ceiling.height:g} m high: at most {int(plan.ceiling.height / flight.rise)} steps fit"
            )


def _windows_inside(plan: FloorPlan) -> Iterator[str]:
    """A window looks at a picture of what is outside, so nothing else of the building may stand behind it."""
    low, high = plan.bounds
    for i, window in enumerate(plan.window):
        wall = plan.wall_named(window.wall)
        frame = LocalFrame.of(wall)
        behind = [
            (np.array([x, y]) - frame.origin) @ frame.inward for x in (low[0], high[0]) for y in (low[1], high[1])
        ]
        if plan.ceiling is not None and min(behind) < -1e-9:
            yield f"window[{i}].wall: '{wall.name}' has parts of the plan behind it; windows fit in walls at its edge"


def _too_small(key: str, item: Any) -> Iterator[str]:
    for side in ("width", "height"):
        if getattr(item, side) < SMALLEST_SIDE:
            yield f"{key}.{side}: {getattr(item, side):g} is not valid; it should be at least {SMALLEST_SIDE:g} m"


def _off_its_wall(plan: FloorPlan, key: str, item: Any) -> Iterator[str]:
    known = [w.name for w in plan.wall]
    if item.wall not in known:
        yield f"{key}.wall: unknown wall '{item.wall}'; known are {', '.join(known)}"
        return
    wall, kind = plan.wall_named(item.wall), key.partition("[")[0]
    yield from _off_sideways(key, kind, item, wall)
    top = item.rise[1]
    if top > plan.wall_height(wall):
        yield (
            f"{key}: {kind} '{item.name}' ends {top:g} m above the floor, outside wall '{wall.name}', "
            f"which is {plan.wall_height(wall):g} m high; lower or shorten it"
        )
    if isinstance(item, Door) and item.recess >= wall.thickness:
        yield f"{key}.recess: {item.recess:g} is not valid; wall '{wall.name}' is {wall.thickness:g} m thick"


def _off_sideways(key: str, kind: str, item: OnWall, wall: Wall) -> Iterator[str]:
    first, last = item.extent
    if first >= 0.0 and last <= wall.length:
        return
    lies = f"{kind} '{item.name}' spans {first:g} to {last:g} m, outside wall '{wall.name}' (0 to {wall.length:g} m)"
    if item.width > wall.length:
        yield f"{key}.width: {item.width:g}: {lies}; a width of at most {wall.length:g} fits"
        return
    yield f"{key}.at: {item.at:g}: {lies}; valid is {item.width / 2:g} to {wall.length - item.width / 2:g}"


def _overlaps(plan: FloorPlan) -> Iterator[str]:
    """Find things on one wall that cover each other."""
    items = list(_listed(plan, ON_WALL))
    for i, (key, item) in enumerate(items):
        for _, other in items[:i]:
            if collide(item, other):
                first, last = other.extent
                yield (
                    f"{key}.at: {item.at:g}: '{item.name}' overlaps '{other.name}', which takes {first:g} to "
                    f"{last:g} m of wall '{item.wall}'"
                )


def collide(item: Any, other: Any) -> bool:
    """Tell whether two things on walls cover each other; an opening may only be above another one just as wide."""
    if item.wall != other.wall or not _meet(item.extent, other.extent):
        return False
    both_open = isinstance(item, Door | Window) and isinstance(other, Door | Window)
    return (both_open and item.extent != other.extent) or _meet(item.rise, other.rise)


def _meet(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return min(a[1], b[1]) - max(a[0], b[0]) > 1e-9


def _outside(plan: FloorPlan) -> Iterator[str]:
    """Find what does not stand between the walls: routes, things that stand free, lamps."""
    places = [(f"routes.{name}[{i}]", p) for name, points in plan.routes.items() for i, p in enumerate(points)]
    places += [(f"{key}.at", item.at) for key, item in _listed(plan, STANDING)]
    places += [(f"{key}.points[{i}]", p) for key, item in _listed(plan, LINES) for i, p in enumerate(item.points)]
    places += [(f"person[{k}].walk[{i}]", p) for k, one in enumerate(plan.person) for i, p in enumerate(one.walk)]
    if plan.ceiling is not None:
        lamps = [(k, i, p) for k, row in enumerate(plan.lamp) for i, p in enumerate(row.positions.tolist())]
        places += [(f"lamp[{k}], lamp {i + 1} of its row", (x, y)) for k, i, (x, y) in lamps]
    areas = rectangles(plan)
    for key, point in places:
        if not any(area.holds(point) for area in areas):
            yield f"{key}: {list(point)} lies outside the walls; {valid_areas(areas)}"


def _misfit_furniture(plan: FloorPlan) -> Iterator[str]:
    """Find furniture that is too small to be built, or that reaches into a wall or the ceiling."""
    areas = rectangles(plan)
    for key, item in _listed(plan, ("furniture",)):
        for side, least in zip(("width", "depth", "height"), SMALLEST[item.kind], strict=True):
            if getattr(item, side) < least:
                yield f"{key}.{side}: {getattr(item, side):g} is not valid; a {item.kind} has at least {least:g} m"
        if plan.ceiling is not None and item.height > plan.ceiling.height:
            yield f"{key}.height: {item.height:g} is not valid; the ceiling is {plan.ceiling.height:g} m high"
        for corner in LocalFrame.under(item).corners(item.width, item.depth):
            if not any(area.holds(corner) for area in areas):
                x, y = corner
                yield f"{key}.at: {item.kind} '{item.name}' reaches to [{x:.2f}, {y:.2f}], outside the walls; move it"


def _hemmed_in(plan: FloorPlan) -> Iterator[str]:
    """Find people who stand or walk in a wall or a thing."""
    things = [thing for thing in taken(plan) if thing.table != "person"]
    for k, person in enumerate(plan.person):
        if any(a == b for a, b in pairwise(person.path)):
            yield f"person[{k}].walk: {short(person.walk)} is not valid; no point should follow itself"
        for way in ways(person.path, PERSON_RADIUS):
            gap = gaps(way, [thing.footprint for thing in things])
            if min(gap, default=0.0) < -1e-9:
                nearest, near = things[int(np.argmin(gap))], max(0.0, gap.min() + PERSON_RADIUS)
                yield (
                    f"person[{k}]: '{person.name}' comes as near as {near:.2f} m to "
                    f"{nearest.table} '{nearest.name}'; it should keep {PERSON_RADIUS:g} m"
                )
