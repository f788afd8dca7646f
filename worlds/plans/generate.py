"""Generate corridors from a seed, so that nobody tunes to one.

A corridor has one to three legs that meet at right angles. What it is like (width, light, how much hangs on its walls
and how evenly) is drawn first, then each thing. All ranges are choices around the hallway's values and what real
buildings have.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats, Span
from refseq_bench.worlds.plans.areas import Rectangle
from refseq_bench.worlds.plans.dials import AS_DRAWN, Dials
from refseq_bench.worlds.plans.footprints import ROOM_SIDE, ROOM_WALL
from refseq_bench.worlds.plans.frame import LocalFrame, left_of
from refseq_bench.worlds.plans.furnish import (
    LEFT,
    RIGHT,
    Character,
    Item,
    Rail,
    draw_character,
    draw_floor,
    draw_materials,
    draw_place,
    end_door,
    glazed_walls,
    items_on,
    lamp_rows,
    modular,
    named,
    repeated,
    without_overlaps,
)
from refseq_bench.worlds.plans.schema import Door, FloorPlan, Wall

SHORTEST_LEG = 12.0
"""Every leg is at least so long [m]: two legs that run side by side keep room for open doors between them."""
END_MARGIN = 2.0
"""Walls stay free so far from both ends of a leg's middle line [m]: a robot swings out where it turns."""
START_MARGIN = 2.0
"""Routes begin and end so far from the end walls [m]."""
BEND_CUT = 1.0
"""Routes leave a leg's middle so far before a corner [m] and meet the next one's so far behind it."""
ROOM_GAP = 0.1
"""The room behind an open door keeps so far from other rooms and corridors [m]."""

Bare = list[tuple[int, Span]]
"""Stretches of legs where next to nothing hangs: a leg, and a span along its middle line."""


def corridor(seed: int, dials: Dials = AS_DRAWN) -> FloorPlan:
    """Return the corridor of a seed, 40 to 120 m long: the same seed and dials give the same plan, bit for bit."""
    rng = np.random.default_rng(seed)
    points = _centre_line(rng)
    like = dials.turned(draw_character(rng))
    walls = _walls(points, like)
    glazed = [w.name for w in walls if _at_edge(w, walls) and _side(w) == like.glazed]
    walls = [w.model_copy(update={"thickness": 0.3}) if w.name in glazed else w for w in walls]
    bare = _bare_stretches(rng, points)
    items = [item for w in walls for item in _hung(rng, like, w, w.name in glazed, points, bare, dials.repetition)]
    items = _closed_where_cramped(items, walls)
    route = route_along(points)
    length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    bends = ("straight", "with a bend", "with two bends")[len(points) - 2]
    plan = FloorPlan.model_validate(
        {
            "name": f"corridor-{seed}{dials.suffix}",
            "title": f"Corridor of {length:.0f} m, {bends}, made from seed {seed}",
            "place": draw_place(rng),
            "floor": draw_floor(rng),
            "ceiling": {"height": like.height, "material": "ceiling"},
            "material": draw_materials(rng),
            "wall": walls,
            **named(items),
            "lamp": lamp_rows(rng, like, list(pairwise(points)), _by_day(len(points) - 1, glazed_walls(items))),
            "routes": {"forward": route, "reverse": route[::-1]},
        }
    )
    return without_overlaps(plan)


def _by_day(legs: int, glazed: set[str]) -> list[bool]:
    """Tell of each leg whether windows let the day in."""
    return [not glazed.isdisjoint((f"{LEFT}-{i + 1}", f"{RIGHT}-{i + 1}")) for i in range(legs)]


# --- the shape ---


def _centre_line(rng: Generator) -> Floats:
    """Points of the middle line, (legs + 1, 2) [m], from the origin along x."""
    legs = int(rng.choice([1, 2, 3], p=[0.4, 0.35, 0.25]))
    total = rng.uniform(40.0, 120.0)
    lengths = SHORTEST_LEG + (total - SHORTEST_LEG * legs) * rng.dirichlet(np.full(legs, 2.0))
    heading, points = np.array([1.0, 0.0]), [np.zeros(2)]
    for length in lengths:
        points.append(points[-1] + round(float(length), 1) * heading)
        heading = rng.choice([-1.0, 1.0]) * left_of(heading)
    return np.round(points, 2)


def _directions(points: Floats) -> Floats:
    steps = np.diff(points, axis=0)
    return steps / np.linalg.norm(steps, axis=1, keepdims=True)


def _walls(points: Floats, like: Character) -> list[Wall]:
    """Left and right wall of each leg, which meet at the bends, and the two end walls."""
    lefts, rights = (_aside(points, offset) for offset in (like.width / 2, -like.width / 2))
    walls = [wall_of("start", rights[0], lefts[0], "right"), wall_of("end", rights[-1], lefts[-1], "left")]
    for i in range(len(points) - 1):
        walls.append(wall_of(f"{LEFT}-{i + 1}", lefts[i], lefts[i + 1], "right"))
        walls.append(wall_of(f"{RIGHT}-{i + 1}", rights[i], rights[i + 1], "left"))
    return walls


def _aside(points: Floats, offset: float) -> Floats:
    """The line ``offset`` to the left of a line of points, (n, 2): at a corner both legs' offsets add."""
    lefts = np.array([left_of(d) for d in _directions(points)])
    at_points = np.concatenate([lefts[:1], lefts[:-1] + lefts[1:], lefts[-1:]])
    return np.round(points + offset * at_points, 3)


def wall_of(name: str, start: Floats, end: Floats, inside: str) -> Wall:
    """A wall of plaster."""
    return Wall.model_validate(
        {"name": name, "start": start.tolist(), "end": end.tolist(), "inside": inside, "material": "plaster"}
    )


def _side(wall: Wall) -> str:
    """On which side of its leg a wall is; none for an end wall."""
    side, _, leg = wall.name.partition("-")
    return side if leg else ""


def _leg(wall: Wall) -> int:
    """The number of the leg that a side wall belongs to, from 0."""
    return int(wall.name.partition("-")[2]) - 1


def _at_edge(wall: Wall, walls: Sequence[Wall]) -> bool:
    """Tell whether nothing of the plan lies behind the wall; only there a window has something to look at."""
    frame = LocalFrame.of(wall)
    corners = np.array([p for w in walls for p in (w.start, w.end)])
    return bool(np.min((corners - frame.origin) @ frame.inward) > -1e-9)


def route_along(points: Floats) -> list[list[float]]:
    """The middle line, without its ends and with cut corners."""
    along = _directions(points)
    route = [points[0] + START_MARGIN * along[0]]
    for corner, before, after in zip(points[1:-1], along[:-1], along[1:], strict=True):
        route += [corner - BEND_CUT * before, corner + BEND_CUT * after]
    route.append(points[-1] - START_MARGIN * along[-1])
    return np.round(route, 3).tolist()


def _bare_stretches(rng: Generator, points: Floats) -> Bare:
    found: Bare = []
    for _ in range(int(rng.integers(4))):
        leg = int(rng.integers(len(points) - 1))
        length = float(np.linalg.norm(points[leg + 1] - points[leg]))
        begin = float(rng.uniform(0.0, length))
        found.append((leg, (begin, begin + float(rng.uniform(5.0, 15.0)))))
    return found


def _on_wall(wall: Wall, points: Floats, spans: Sequence[Span]) -> list[Span]:
    """Spans along the middle line of a wall's leg as spans from the wall's own start."""
    frame = LocalFrame.of(wall)
    shift = float((points[_leg(wall)] - frame.origin) @ frame.along)
    return [(a + shift, b + shift) for a, b in spans]


def _hung(
    rng: Generator, like: Character, wall: Wall, glazed: bool, points: Floats, bare: Bare, share: float | None
) -> list[Item]:
    """All that hangs on a wall or stands against it."""
    if not _side(wall):
        return end_door(rng, wall)
    leg = _leg(wall)
    length = float(np.linalg.norm(points[leg + 1] - points[leg]))
    rail = Rail(_on_wall(wall, points, [(END_MARGIN, length - END_MARGIN)])[0])
    blank = _on_wall(wall, points, [span for on, span in bare if on == leg])
    items = items_on(rng, like, wall, rail, glazed=glazed, blank=blank)
    if share is not None:
        return modular(rng, items, rail.span, share)
    return repeated(rng, items, rail.span) if rng.random() < 0.4 else items


# --- what must fit together ---


def _closed_where_cramped(items: list[Item], walls: Sequence[Wall]) -> list[Item]:
    """Close each open door whose room would stand in another leg or in the room of a door before it."""
    side_walls = [w for w in walls if _side(w)]
    grounds = {
        wall.name: [_ground([w for w in side_walls if _leg(w) == leg]) for leg in _other_legs(wall, walls)]
        for wall in side_walls
    }
    return closed_where_cramped(items, side_walls, grounds)


def closed_where_cramped(
    items: list[Item], walls: Sequence[Wall], grounds: Mapping[str, Sequence[Rectangle]]
) -> list[Item]:
    """Close each open door whose room would stand on its wall's ``grounds`` or in the room of a door before it."""
    on = {w.name: w for w in walls}
    rooms: list[Rectangle] = []
    found = []
    for item in items:
        if item.get("open"):
            room = _room(item, on[item["wall"]])
            cramped = any(_overlap(room, area) for area in (*grounds.get(item["wall"], ()), *rooms))
            rooms += [] if cramped else [room]
            found.append({**item, "open": 0.0} if cramped else item)
        else:
            found.append(item)
    return found


def _other_legs(wall: Wall, walls: Sequence[Wall]) -> set[int]:
    return {_leg(w) for w in walls if _side(w)} - {_leg(wall)}


def _ground(walls: Sequence[Wall]) -> Rectangle:
    """The ground between two side walls with the walls themselves, at most 0.3 m thick."""
    corners = np.array([p for w in walls for p in (w.start, w.end)])
    return Rectangle(corners.min(axis=0) - 0.3, corners.max(axis=0) + 0.3)


def _room(item: Item, wall: Wall) -> Rectangle:
    frame, half = LocalFrame.of(wall), item["width"] / 2 + ROOM_SIDE + ROOM_WALL + ROOM_GAP
    depth = Door.model_fields["depth"].default + wall.thickness + ROOM_WALL + ROOM_GAP
    corners = np.array([frame.point(item["at"] + s, out, 0.0)[:2] for s in (-half, half) for out in (0.0, -depth)])
    return Rectangle(corners.min(axis=0), corners.max(axis=0))


def _overlap(a: Rectangle, b: Rectangle) -> bool:
    return bool(np.all(a.low < b.high) and np.all(b.low < a.high))
