"""Generate corridors from a seed, so that nobody tunes to one.

A corridor has one to three legs that meet at right angles. What it is like (width, light, how much hangs on its walls
and how evenly) is drawn first, then each thing. All ranges are choices around the hallway's values and what real
buildings have.
"""

import datetime
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats, Span
from refseq_bench.worlds.plans.areas import Rectangle
from refseq_bench.worlds.plans.footprints import ROOM_SIDE, ROOM_WALL
from refseq_bench.worlds.plans.frame import LocalFrame, left_of
from refseq_bench.worlds.plans.schema import Door, FloorPlan, Wall

SHORTEST_LEG = 12.0
"""Every leg is at least so long [m]: two legs that run side by side keep room for open doors between them."""
END_MARGIN = 2.0
"""Walls stay free so far from both ends of a leg's middle line [m]: a robot swings out where it turns."""
START_MARGIN = 2.0
"""Routes begin and end so far from the end walls [m]."""
BEND_CUT = 1.0
"""Routes leave a leg's middle so far before a corner [m] and meet the next one's so far behind it."""
PLATE = 0.3
"""A door keeps so much of the wall beside it free [m]: its number plate hangs there."""
TRIES = 8
"""A thing that finds no free place on its wall in so many draws is left out."""
ROOM_GAP = 0.1
"""The room behind an open door keeps so far from other rooms and corridors [m]."""

LEFT, RIGHT = "left", "right"
Item = dict[str, Any]
"""An entry of the plan with its ``table``; names come last."""
Bare = list[tuple[int, Span]]
"""Stretches of legs where next to nothing hangs: a leg, and a span along its middle line."""


@dataclass(frozen=True, slots=True)
class _Character:
    """Character of a corridor. ``rates`` are things a metre of wall; lengths in [m].

    ``glazed`` names the side that has windows, ``floor`` is what the doors' numbers begin with.

    ``evenness`` is the shape of the gamma distribution of the gaps between doors: 1 is chance, 40 nearly regular.
    """

    width: float
    height: float
    glazed: str
    floor: int
    pitch: float
    pane: float
    door_gap: float
    evenness: float
    open_share: float
    rates: dict[str, float]
    lamp_step: float
    lumen: float


def corridor(seed: int) -> FloorPlan:
    """Return the corridor of a seed, 40 to 120 m long: the same seed gives the same plan, bit for bit."""
    rng = np.random.default_rng(seed)
    points = _centre_line(rng)
    like = _character(rng)
    walls = _walls(points, like)
    glazed = [w.name for w in walls if _at_edge(w, walls) and _side(w) == like.glazed]
    walls = [w.model_copy(update={"thickness": 0.3}) if w.name in glazed else w for w in walls]
    bare = _bare_stretches(rng, points)
    items = [item for w in walls for item in _hung(rng, like, w, w.name in glazed, points, bare)]
    items = _closed_where_cramped(items, walls)
    route = _route(points)
    length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    bends = ("straight", "with a bend", "with two bends")[len(points) - 2]
    return FloorPlan.model_validate(
        {
            "name": f"corridor-{seed}",
            "title": f"Corridor of {length:.0f} m, {bends}, made from seed {seed}",
            "place": _place(rng),
            "floor": _floor(rng),
            "ceiling": {"height": like.height, "material": "ceiling"},
            "material": _materials(rng),
            "wall": walls,
            **_named(items),
            "lamp": _lamps(rng, like, points),
            "routes": {"forward": route, "reverse": route[::-1]},
        }
    )


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


def _walls(points: Floats, like: _Character) -> list[Wall]:
    """Left and right wall of each leg, which meet at the bends, and the two end walls."""
    lefts, rights = (_aside(points, offset) for offset in (like.width / 2, -like.width / 2))
    walls = [_wall("start", rights[0], lefts[0], "right"), _wall("end", rights[-1], lefts[-1], "left")]
    for i in range(len(points) - 1):
        walls.append(_wall(f"{LEFT}-{i + 1}", lefts[i], lefts[i + 1], "right"))
        walls.append(_wall(f"{RIGHT}-{i + 1}", rights[i], rights[i + 1], "left"))
    return walls


def _aside(points: Floats, offset: float) -> Floats:
    """The line ``offset`` to the left of a line of points, (n, 2): at a corner both legs' offsets add."""
    lefts = np.array([left_of(d) for d in _directions(points)])
    at_points = np.concatenate([lefts[:1], lefts[:-1] + lefts[1:], lefts[-1:]])
    return np.round(points + offset * at_points, 3)


def _wall(name: str, start: Floats, end: Floats, inside: str) -> Wall:
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


def _route(points: Floats) -> list[list[float]]:
    """The middle line, without its ends and with cut corners."""
    along = _directions(points)
    route = [points[0] + START_MARGIN * along[0]]
    for corner, before, after in zip(points[1:-1], along[:-1], along[1:], strict=True):
        route += [corner - BEND_CUT * before, corner + BEND_CUT * after]
    route.append(points[-1] - START_MARGIN * along[-1])
    return np.round(route, 3).tolist()


# --- what it is like ---


def _character(rng: Generator) -> _Character:
    def rate(most: float) -> float:
        """Squared, so that things are more often rare than frequent."""
        return float(most * rng.random() ** 2)

    step = round(float(rng.uniform(2.4, 6.0)), 1)
    return _Character(
        width=round(float(rng.uniform(1.8, 3.0)), 1),
        height=round(float(rng.uniform(2.4, 3.2)), 1),
        glazed=str(rng.choice([LEFT, RIGHT, "neither"], p=[0.35, 0.35, 0.3])),
        floor=int(rng.integers(1, 5)),
        pitch=round(float(rng.uniform(3.2, 6.5)), 1),
        pane=round(float(rng.uniform(1.2, 2.2)), 1),
        door_gap=float(rng.uniform(3.0, 9.0)),
        evenness=float(rng.choice([1.0, 4.0, 40.0])),
        open_share=float(rng.choice([0.0, 0.1, 0.25])),
        rates={
            "poster": rate(0.35),
            "board": rate(0.08),
            "cabinet": rate(0.12),
            "bin": rate(0.08),
            "extinguisher": 0.01 + rate(0.05),
            "switch": rate(0.08),
            "sign": rate(0.06),
        },
        lamp_step=step,
        lumen=round(step * float(rng.uniform(180.0, 500.0)), -1),
    )


def _place(rng: Generator) -> Item:
    day = datetime.date(2008, 1, 1) + datetime.timedelta(days=int(rng.integers(366)))
    azimuth = float(rng.integers(360))
    return {"latitude": 40.63, "longitude": -8.66, "timezone": "Europe/Lisbon", "date": day, "x_azimuth": azimuth}


def _floor(rng: Generator) -> Item:
    pattern, tile = [("tiles", 0.3), ("tiles", 0.4), ("tiles", 0.6), ("carpet", 0.5), ("parquet", 0.4)][rng.integers(5)]
    return {"material": "floor", "tile": tile, "pattern": pattern}


ALBEDOS = {
    "plaster": (0.5, 0.85, 0.95),
    "floor": (0.15, 0.45, 0.55),
    "ceiling": (0.65, 0.9, 0.95),
    "door": (0.12, 0.5, 0.5),
    "metal": (0.25, 0.6, 0.45),
    "dark": (0.04, 0.1, 0.4),
    "light": (0.65, 0.85, 0.5),
}
"""Least and greatest albedo of each material, and its roughness: painted walls, floors and fittings (M)."""


def _materials(rng: Generator) -> dict[str, Item]:
    return {
        name: {"albedo": round(float(rng.uniform(low, high)), 2), "roughness": roughness}
        for name, (low, high, roughness) in ALBEDOS.items()
    }


def _lamps(rng: Generator, like: _Character, points: Floats) -> list[Item]:
    """One row a leg, in its middle, along it."""
    switch, kelvin = str(rng.choice(["dusk", "always"])), float(rng.choice([3000.0, 4000.0]))
    rows = []
    for i, ((start, end), along) in enumerate(zip(pairwise(points), _directions(points), strict=True)):
        count = max(1, int((np.linalg.norm(end - start) - like.lamp_step / 2) / like.lamp_step))
        size = [1.2, 0.3] if along[0] else [0.3, 1.2]
        first, step = start + like.lamp_step / 2 * along, like.lamp_step * along
        row = {"first": np.round(first, 3).tolist(), "step": np.round(step, 3).tolist(), "count": count, "size": size}
        rows.append({"name": f"leg-{i + 1}", **row, "lumen": like.lumen, "kelvin": kelvin, "switch": switch})
    return rows


# --- what hangs on the walls ---


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


class _Rail:
    """The ``span`` of a wall on which things find a place; what is ``taken`` of it is not free."""

    def __init__(self, span: Span) -> None:
        self.span = span
        self.taken: list[Span] = []

    def take(self, at: float, width: float, beside: float = 0.05) -> bool:
        """Take the place for something ``width`` wide around ``at`` if it is free, ``beside`` it too."""
        low, high = at - width / 2 - beside, at + width / 2 + beside
        if low < self.span[0] or high > self.span[1] or any(low < b and a < high for a, b in self.taken):
            return False
        self.taken.append((low, high))
        return True

    def find(self, rng: Generator, width: float) -> float | None:
        """Take any free place for something ``width`` wide; None where none was found."""
        draws = (round(float(at), 2) for at in rng.uniform(*self.span, TRIES))
        return next((at for at in draws if self.take(at, width)), None)


def _hung(rng: Generator, like: _Character, wall: Wall, glazed: bool, points: Floats, bare: Bare) -> list[Item]:
    """All that hangs on a wall or stands against it."""
    if not _side(wall):
        return _end_door(rng, wall)
    leg = _leg(wall)
    length = float(np.linalg.norm(points[leg + 1] - points[leg]))
    rail = _Rail(_on_wall(wall, points, [(END_MARGIN, length - END_MARGIN)])[0])
    items = _windows(rng, like, rail) if glazed else []
    items += _doors(rng, like, rail, glazed)
    rail.taken += _on_wall(wall, points, [span for on, span in bare if on == leg])
    for kind, rate in like.rates.items():
        for _ in range(int(rng.poisson(rate * wall.length))):
            thing = CLUTTER[kind](rng)
            if (at := rail.find(rng, thing["width"])) is not None:
                items.append({**thing, "at": at})
    items = [{**item, "wall": wall.name} for item in items]
    return _repeated(rng, items, rail.span) if rng.random() < 0.4 else items


def _end_door(rng: Generator, wall: Wall) -> list[Item]:
    if rng.random() < 0.4:
        return []
    label = str(rng.choice(["A", "B", "EXIT", ""]))
    return [{"table": "door", "wall": wall.name, "at": round(wall.length / 2, 2), "width": 1.2, "label": label}]


def _windows(rng: Generator, like: _Character, rail: _Rail) -> list[Item]:
    """Windows at a regular pitch, some left out; a radiator stands under some."""
    items: list[Item] = []
    glazing, first = str(rng.choice(["4mm", "6mm", "double"])), rail.span[0] + float(rng.uniform(0.0, 4.0))
    height = round(min(1.5, like.height - 1.1), 2)
    for at in np.round(np.arange(first, rail.span[1], like.pitch), 2).tolist():
        if rng.random() < 0.15 or not rail.take(at, like.pane, 0.1):
            continue
        items.append({"table": "window", "at": at, "width": like.pane, "height": height, "glazing": glazing})
        if rng.random() < 0.4:
            radiator = {"width": 1.0, "height": 0.55, "bottom": 0.15, "depth": 0.09, "material": "metal"}
            items.append({"table": "fixture", "at": at, "kind": "radiator", **radiator})
    return items


def _doors(rng: Generator, like: _Character, rail: _Rail, glazed: bool) -> list[Item]:
    """Doors with gamma-distributed gaps; few and closed where there are windows."""
    items: list[Item] = []
    number = int(rng.integers(1, 9))
    at = rail.span[0] + float(rng.uniform(0.8, 5.0))
    while at < rail.span[1]:
        place, number = round(at, 2), number + int(rng.choice([1, 2, 2, 2, 4]))
        keep, leaf = not glazed or rng.random() < 0.2, _leaf(rng, like, number)
        if keep and rail.take(place, leaf["width"], PLATE):
            items.append({**leaf, "at": place, "open": 0.0 if glazed else leaf["open"]})
        at += 1.6 + float(rng.gamma(like.evenness, (like.door_gap - 1.6) / like.evenness))
    return items


def _leaf(rng: Generator, like: _Character, number: int) -> Item:
    label = str(rng.choice([f"{like.floor}.{number:02d}", "WC", "LAB", ""], p=[0.8, 0.06, 0.06, 0.08]))
    return {
        "table": "door",
        "width": float(rng.choice([0.8, 0.9, 0.9, 0.9, 1.2])),
        "open": float(rng.integers(20, 105)) if rng.random() < like.open_share else 0.0,
        "hinge": str(rng.choice(["start", "end"])),
        "label": label,
    }


def _poster(rng: Generator) -> Item:
    sizes = ((0.841, 1.189, 0.85), (0.594, 0.841, 1.0), (1.189, 0.841, 1.0))
    width, height, bottom = sizes[rng.choice(3, p=[0.5, 0.35, 0.15])]
    style = str(rng.choice(["text", "plots", "photo", "mixed", "diagram"]))
    return {"table": "poster", "width": width, "height": height, "bottom": bottom, "style": style}


def _board(rng: Generator) -> Item:
    width = float(rng.choice([1.2, 1.8, 2.4]))
    return {"table": "board", "width": width, "sheets": int(width * rng.integers(3, 8))}


def _cabinet(rng: Generator) -> Item:
    width, height = float(rng.choice([0.5, 0.8, 1.0, 1.2])), float(rng.choice([0.9, 1.3, 1.8]))
    return {"table": "cabinet", "width": width, "height": height, "depth": float(rng.choice([0.25, 0.35]))}


def _bin(rng: Generator) -> Item:
    return {"table": "bin", "width": float(rng.choice([0.22, 0.28, 0.34])), "height": float(rng.choice([0.4, 0.6]))}


def _fixture(kind: str, width: float, height: float, bottom: float, depth: float, material: str) -> Item:
    shape = {"width": width, "height": height, "bottom": bottom, "depth": depth}
    return {"table": "fixture", "kind": kind, **shape, "material": material}


CLUTTER: Mapping[str, Callable[[Generator], Item]] = {
    "poster": _poster,
    "board": _board,
    "cabinet": _cabinet,
    "bin": _bin,
    "extinguisher": lambda rng: _fixture("extinguisher", 0.16, 0.5, 0.9, 0.16, "dark"),
    "switch": lambda rng: _fixture("switch", 0.085, 0.085, 1.05, 0.012, "light"),
    "sign": lambda rng: _fixture("sign", 0.45, 0.18, 2.2, 0.02, "dark"),
}


def _repeated(rng: Generator, items: list[Item], whole: Span) -> list[Item]:
    """Let a stretch of the wall come again further on, thing for thing, instead of what was there."""
    span = float(rng.uniform(7.0, 14.0))
    room = whole[1] - whole[0] - 2 * span
    if room < 0.0:
        return items
    begin, shift = whole[0] + float(rng.uniform(0.0, room)), round(span + 0.1, 1)
    source = [item for item in items if _within(item, begin, begin + span)]
    kept = [item for item in items if not _reaches(item, begin + shift, begin + shift + span)]
    copies = [{**item, "at": round(item["at"] + shift, 2)} for item in source]
    return kept + [copy for copy in copies if copy["at"] + _half(copy) <= whole[1]]


def _half(item: Item) -> float:
    """Half of what a thing takes of its wall [m]."""
    return float(item["width"] / 2 + (PLATE if item["table"] == "door" else 0.0))


def _within(item: Item, low: float, high: float) -> bool:
    return bool(low <= item["at"] - _half(item) and item["at"] + _half(item) <= high)


def _reaches(item: Item, low: float, high: float) -> bool:
    return bool(item["at"] + _half(item) > low and item["at"] - _half(item) < high)


# --- what must fit together ---


def _closed_where_cramped(items: list[Item], walls: Sequence[Wall]) -> list[Item]:
    """Close each open door whose room would stand in another leg or in the room of a door before it."""
    side_walls = {w.name: w for w in walls if _side(w)}
    rooms: list[Rectangle] = []
    found = []
    for item in items:
        if item.get("open"):
            wall = side_walls[item["wall"]]
            room = _room(item, wall)
            legs = [_ground([w for w in side_walls.values() if _leg(w) == leg]) for leg in _other_legs(wall, walls)]
            cramped = any(_overlap(room, area) for area in (*legs, *rooms))
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


def _named(items: list[Item]) -> dict[str, list[Item]]:
    """Sort the entries into their tables, along each wall, and name them by the table's letter and a number."""
    items = sorted(items, key=lambda item: (item["wall"], item["at"]))
    letters = {"window": "w", "door": "d", "poster": "p", "board": "b", "cabinet": "c", "bin": "n", "fixture": "f"}
    return {
        table: [
            {"name": f"{letter}{i + 1:02d}", **{k: v for k, v in item.items() if k != "table"}}
            for i, item in enumerate(item for item in items if item["table"] == table)
        ]
        for table, letter in letters.items()
    }
