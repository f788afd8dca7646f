"""Change single things of a plan: open doors, move furniture, swap posters, park cars anew.

Every alteration takes a plan, a strength and a seed and returns the plan changed. It goes through the things that it
touches one after another, in an order that does not depend on the strength: so a greater strength leaves what a lesser
one did as it is, and adds to it.
"""

import zlib
from collections.abc import Mapping
from itertools import chain, count
from types import MappingProxyType
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.plans.areas import Rectangle, rectangles
from refseq_bench.worlds.plans.footprints import (
    Footprint,
    against,
    corners,
    footprints,
    gaps,
    room_behind,
    strip,
    taken,
    ways,
)
from refseq_bench.worlds.plans.rules import collide
from refseq_bench.worlds.plans.schema import ON_WALL, Bin, Cabinet, Car, Door, FloorPlan, Furniture, OnWall, Poster

WAY = 0.6
"""Half the width of what is kept free along a route [m]: a robot of 0.8 m that wanders by 0.2 m."""
TURN = 1.05
"""Radius of what is kept free where a route begins, bends and ends [m]: there a robot turns around its axle, 0.82 m
from its rear corners, and wanders."""
MARGIN = 0.02
"""Least gap between things [m]."""
TRIES = 30
"""So many places are drawn for a thing that moves; if none is free it stays where it is."""
THRESHOLD = 0.6
"""Depth of the ground before a door on which nobody stands and nothing is put [m]."""
OUTLOOK = 20.0
"""So far outside a wall with windows [m] there is nothing but what they show."""
ASTRAY = MappingProxyType({"chair": 1.5, "box": 1.5, "bin": 3.0})
"""Longest way that light things are moved [m]."""
NUDGED = MappingProxyType({"table": 0.4, "cupboard": 0.4, "shelf": 0.4, "cabinet": 0.8})
"""Longest way that heavy things are moved [m]."""
STYLES = get_args(Poster.model_fields["style"].annotation)
POSTER_GAP = 0.08
"""Least gap between a new poster and what else is on the wall [m]."""

Movable = Bin | Cabinet | Furniture


def drawn(kind: str, things: Mapping[str, Any], strength: float, seed: int) -> list[tuple[Any, Generator]]:
    """Return the things that are touched, each with its generator; more strength only adds some at the end."""
    rngs = {name: np.random.default_rng([seed, zlib.crc32(f"{kind} {name}".encode())]) for name in things}
    ranks = {name: rng.random() for name, rng in rngs.items()}
    return [(things[name], rngs[name]) for name in sorted(ranks, key=ranks.__getitem__) if ranks[name] < strength]


def _named(items: tuple[Any, ...]) -> dict[str, Any]:
    return {item.name: item for item in items}


def free_name(name: str, items: tuple[Any, ...]) -> str:
    """Return ``name``, with a number behind it where one of ``items`` has it: what was changed can change again."""
    taken = {item.name for item in items}
    return next(one for one in chain([name], (f"{name}-{i}" for i in count(2))) if one not in taken)


def put(plan: FloorPlan, table: str, old: Any, *new: Any) -> FloorPlan:
    """Replace a thing of a table by none, one or more."""
    items = getattr(plan, table)
    k = items.index(old)
    return plan.model_copy(update={table: (*items[:k], *new, *items[k + 1 :])})


# --- doors ---


def change_doors(plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Shut what was open or open it by another angle; open what was shut where a room fits behind."""
    for door, rng in drawn("door", _named(plan.door), strength, seed):
        angle = 0.0 if door.open and rng.random() < 0.5 else round(float(rng.uniform(10.0, 100.0)), 1)
        if not angle or door.open or _room_fits(plan, door):
            plan = put(plan, "door", door, door.model_copy(update={"open": angle}))
    return plan


def _room_fits(plan: FloorPlan, door: Door) -> bool:
    """Tell whether there is ground for a room behind: where no corridor, no other room is, and no window looks out."""
    if plan.ceiling is None:
        return False
    lit = [plan.wall_named(name) for name in {window.wall for window in plan.window}]
    outlooks = [against(plan, w.name, (0.0, w.length), (-OUTLOOK, -w.thickness)) for w in lit]
    corridors = [Footprint(area.middle[0], area.middle[1], 0.0, *(area.size / 2).tolist()) for area in rectangles(plan)]
    rooms = [room_behind(plan, other) for other in plan.door if other.open]
    return bool(gaps(room_behind(plan, door), outlooks + corridors + rooms).min() > 0.0)


# --- things that are moved ---


def move(reach: Mapping[str, float], plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Move things of the kinds in ``reach`` by up to so many metres: along their wall, or any way on the floor."""
    things: tuple[Movable, ...] = (*plan.bin, *plan.cabinet, *plan.furniture)
    movable = {f"{_kind(thing)} {thing.name}": thing for thing in things if _kind(thing) in reach}
    for item, rng in drawn("moved", movable, strength, seed):
        others = _Others.of(plan, item)
        places = (_shifted(item, reach[_kind(item)], rng) for _ in range(TRIES))
        place = next(filter(others.leave_room_for, places), item)
        plan = put(plan, _table(item), item, place)
    return plan


def _table(item: Movable | Car) -> str:
    return type(item).__name__.lower()


def _kind(item: Movable) -> str:
    return getattr(item, "kind", _table(item))


def _shifted(item: Movable, reach: float, rng: Generator) -> Movable:
    """Shift a thing by a tenth of ``reach`` at least; what is light is turned anyhow, too."""
    by, angle = rng.uniform(0.1, 1.0) * reach, rng.uniform(-np.pi, np.pi)
    if isinstance(item, Bin | Cabinet):
        return item.model_copy(update={"at": round(item.at + float(np.copysign(by, angle)), 2)})
    x, y = np.round(np.array(item.at) + by * np.array([np.cos(angle), np.sin(angle)]), 2).tolist()
    turn = rng.uniform(-1.0, 1.0) * (180.0 if item.kind in ASTRAY else 8.0)
    return item.model_copy(update={"at": (x, y), "heading": round(item.heading + float(turn), 1)})


class _Others(NamedTuple):
    """A plan without one thing: where that thing may stand, and what ground is taken or kept free."""

    plan: FloorPlan
    areas: tuple[Rectangle, ...]
    ground: list[Footprint]
    routes: list[Footprint]

    @classmethod
    def of(cls, plan: FloorPlan, item: Movable | Car) -> "_Others":
        rest, own_wall = put(plan, _table(item), item), ("wall", getattr(item, "wall", None))
        things = [thing.footprint for thing in taken(rest) if (thing.table, thing.name) != own_wall]
        return cls(rest, rectangles(plan), things + thresholds(plan), kept_free(plan))

    def leave_room_for(self, item: Movable | Car) -> bool:
        if isinstance(item, Bin | Cabinet) and not _hangs_free(self.plan, item):
            return False
        (ground,) = footprints(self.plan, item)
        if not all(any(area.holds(corner) for area in self.areas) for corner in corners(ground)):
            return False
        off_routes = gaps(ground, self.routes).min() >= 0.0
        return bool(off_routes and gaps(ground, self.ground).min(initial=np.inf) >= MARGIN)


def _hangs_free(plan: FloorPlan, item: OnWall) -> bool:
    """Tell whether a thing finds room on its wall among all that is there."""
    first, last = item.extent
    there = (other for table in ON_WALL for other in getattr(plan, table))
    fits = first >= 0.0 and last <= plan.wall_named(item.wall).length
    return fits and not any(collide(item, other) for other in there)


def thresholds(plan: FloorPlan) -> list[Footprint]:
    """Return the ground before each door."""
    return [against(plan, door.wall, door.extent, (0.0, THRESHOLD)) for door in plan.door]


def kept_free(plan: FloorPlan) -> list[Footprint]:
    """Return what stays free for the robot."""
    lines = plan.routes.values()
    turns = {point for points in lines for point in points}
    return [way for points in lines for way in ways(points, WAY)] + [strip(p, p, TURN) for p in sorted(turns)]


# --- posters ---


def change_posters(plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Take a poster away, hang another in its place, or hang a new one elsewhere on its wall."""
    for poster, rng in drawn("poster", _named(plan.poster), strength, seed):
        other = {"name": free_name(f"new-{poster.name}", plan.poster), "style": STYLES[rng.integers(len(STYLES))]}
        match rng.integers(3):
            case 0:
                plan = put(plan, "poster", poster)
            case 1:
                plan = put(plan, "poster", poster, poster.model_copy(update=other))
            case _:
                plan = put(plan, "poster", poster, poster, *_hung(plan, poster.model_copy(update=other), rng))
    return plan


def _hung(plan: FloorPlan, poster: Poster, rng: Generator) -> list[Poster]:
    """Return the poster where it finds room on its wall, or nothing."""
    length = plan.wall_named(poster.wall).length
    for _ in range(TRIES):
        place = poster.model_copy(update={"at": round(float(rng.uniform(0.0, length)), 2)})
        if _hangs_free(plan, place.model_copy(update={"width": place.width + 2 * POSTER_GAP})):
            return [place]
    return []


# --- cars ---


def repark_cars(plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Half of the cars that are touched have left; the others stand in a bay that one has left, if one fits them."""
    left: list[Car] = []
    for car, rng in drawn("car", _named(plan.car), strength, seed):
        bays = [left[i] for i in rng.permutation(len(left))] if rng.random() < 0.5 else []
        places = (car.model_copy(update={"at": bay.at, "heading": bay.heading}) for bay in bays)
        place = next(filter(_Others.of(plan, car).leave_room_for, places), None)
        plan = put(plan, "car", car, *([place] if place else []))
        left = [bay for bay in left if place is None or bay.at != place.at] + [car]
    return plan
