"""Footprints of the things of a plan, and the distances between them.

Everything is one kind of shape: a rectangle grown by a radius. A wall is one of radius 0, a bin one without sides, a
person's way to and fro one without width.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import (
    ON_WALL,
    STANDING,
    Bin,
    Cabinet,
    Car,
    Door,
    Fixture,
    FloorPlan,
    Furniture,
    OnWall,
    Person,
    Point,
    Stairs,
    Standing,
    Tree,
)

PERSON_RADIUS = 0.27
"""Half the room that a person takes [m], elbows and all; those of the figures up to 1.9 m stay within it."""
OVERHEAD = 2.0
"""Things that begin higher up than this [m] are in nobody's way."""
CAR_SIZES = {"hatchback": (3.9, 1.7), "saloon": (4.4, 1.8), "van": (4.5, 1.85)}
"""Length and width of each kind of car [m]: at least what ``refseq_bench.worlds.parts.cars`` draws, wheels and all."""
POST_RADIUS = 0.07
"""Radius of a lamp post [m]."""
OFF_WALL = 0.02
"""Gap between what is round and the wall that it stands against [m]."""
ROOM_SIDE, ROOM_WALL = 0.6, 0.1
"""Length that the room behind an open door goes on past each of its sides, and thickness of its own walls [m]."""


class Footprint(NamedTuple):
    """A rectangle around (x, y) with sides 2 ``length`` along ``heading`` and 2 ``width``, grown by ``radius`` [m]."""

    x: float
    y: float
    heading: float = 0.0
    length: float = 0.0
    width: float = 0.0
    radius: float = 0.0


class Occupied(NamedTuple):
    """A footprint, and whose it is: the plan's table and the name there."""

    table: str
    name: str
    footprint: Footprint


def strip(start: ArrayLike, end: ArrayLike, radius: float) -> Footprint:
    """Return what a disc takes that moves from ``start`` to ``end``, (2,) each."""
    start, along = np.asarray(start, dtype=float), np.subtract(end, start)
    x, y = start + along / 2
    return Footprint(x, y, float(np.arctan2(along[1], along[0])), float(np.hypot(*along)) / 2, 0.0, radius)


def ways(points: tuple[Point, ...], radius: float) -> list[Footprint]:
    """Return what a disc takes that moves along ``points``; a single point is a place."""
    return [strip(a, b, radius) for a, b in pairwise(points)] or [strip(points[0], points[0], radius)]


def taken(plan: FloorPlan) -> tuple[Occupied, ...]:
    """Return the ground that everything takes which stands in the way of somebody who walks."""
    found = [Occupied("wall", w.name, against(plan, w.name, (0.0, w.length), (-w.thickness, 0.0))) for w in plan.wall]
    for table in (*ON_WALL, *STANDING):
        found += [Occupied(table, i.name, f) for i in getattr(plan, table) for f in footprints(plan, i)]
    for kerb in plan.kerb:
        found += [Occupied("kerb", kerb.name, f) for f in ways(kerb.points, kerb.width / 2)]
    return tuple(found)


def footprints(plan: FloorPlan, item: OnWall | Standing) -> list[Footprint]:
    """Return what ground one thing takes; nothing for what is flat on a wall, or overhead."""
    match item:
        case Bin():
            x, y, _ = LocalFrame.of(plan.wall_named(item.wall)).point(item.at, item.width / 2 + OFF_WALL, 0.0)
            return [Footprint(x, y, radius=item.width / 2)]
        case Cabinet() | Fixture() if item.rise[0] < OVERHEAD:
            return [against(plan, item.wall, item.extent, (0.0, item.depth))]
        case Person():
            return ways(item.path, PERSON_RADIUS)
        case Standing():
            return [_standing(item)]
    return []


def against(plan: FloorPlan, wall: str, s: tuple[float, float], out: tuple[float, float]) -> Footprint:
    """Return the rectangle between two distances ``s`` along a wall and two ``out`` of it, into the room [m]."""
    frame = LocalFrame.of(plan.wall_named(wall))
    x, y, _ = frame.point(sum(s) / 2, sum(out) / 2, 0.0)
    return Footprint(
        x, y, float(np.arctan2(frame.along[1], frame.along[0])), (s[1] - s[0]) / 2, abs(out[1] - out[0]) / 2
    )


def _standing(item: Standing) -> Footprint:
    """Return the ground of what stands free and still."""
    (x, y), heading = item.at, np.radians(item.heading)
    match item:
        case Furniture():
            return Footprint(x, y, heading, item.width / 2, item.depth / 2)
        case Car():
            length, width = CAR_SIZES[item.kind]
            return Footprint(x, y, heading, length / 2, width / 2)
        case Stairs():
            half = item.steps * item.run / 2
            return Footprint(x + half * np.cos(heading), y + half * np.sin(heading), heading, half, item.width / 2)
        case Tree():
            return Footprint(x, y, radius=item.trunk)
    return Footprint(x, y, radius=POST_RADIUS)


def room_behind(plan: FloorPlan, door: Door) -> Footprint:
    """Return the ground that the room behind a door takes, walls and all."""
    back, side, (first, last) = plan.wall_named(door.wall).thickness, ROOM_SIDE + ROOM_WALL, door.extent
    return against(plan, door.wall, (first - side, last + side), (-back - door.depth - ROOM_WALL, -back))


def corners(shape: Footprint) -> Floats:
    """Return the corners of a rectangle before it is grown, (4, 2), counter-clockwise."""
    return _corners(np.asarray(shape, dtype=float)[None, :])[0]


# --- distances ---


def gaps(one: Footprint, others: ArrayLike) -> Floats:
    """Distance from ``one`` to each of ``others``, rows of (m, 6) like it; (m,) [m], negative where they overlap.

    Two convex polygons that do not overlap are nearest at a corner of one of them; whether they do is told by the four
    axes along their sides (separating axis theorem). By how much rectangles overlap is not told: only their radii are.
    """
    others = np.asarray(others, dtype=float).reshape(-1, 6)
    mine = np.asarray(one, dtype=float)[None, :]
    to_them = _apart(_corners(mine)[0], others).min(axis=1, initial=np.inf)
    to_me = _apart(_corners(others).reshape(-1, 2), mine).reshape(-1, 4).min(axis=1)
    apart = np.minimum(to_them, to_me) * ~_overlap(mine, others)
    return apart - one.radius - others[:, 5]


def clearance(points: ArrayLike, others: ArrayLike) -> Floats:
    """Distance from each of ``points`` (n, 2) to the nearest of ``others`` (m, 6), (n,) [m]; infinite if m is 0."""
    others = np.asarray(others, dtype=float).reshape(-1, 6)
    apart = _apart(np.asarray(points, dtype=float), others) - others[:, 5, None]
    return np.asarray(apart.min(axis=0, initial=np.inf))


def _axes(shapes: Floats) -> Floats:
    """Unit vectors along and across each, (m, 2 axes, 2)."""
    cos, sin = np.cos(shapes[:, 2]), np.sin(shapes[:, 2])
    return np.stack([np.stack([cos, sin], axis=1), np.stack([-sin, cos], axis=1)], axis=1)


def _corners(shapes: Floats) -> Floats:
    """Corners before they are grown, (m, 4, 2), counter-clockwise."""
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return shapes[:, None, :2] + (signs * shapes[:, None, 3:5]) @ _axes(shapes)


def _apart(points: Floats, shapes: Floats) -> Floats:
    """Distance of each of ``points`` (n, 2) from each shape before it is grown, (m, n)."""
    local = (points[None] - shapes[:, None, :2]) @ _axes(shapes).swapaxes(1, 2)  # (m, n, 2)
    outside = np.maximum(np.abs(local) - shapes[:, None, 3:5], 0.0)
    return np.asarray(np.hypot(outside[..., 0], outside[..., 1]))


def _overlap(mine: Floats, others: Floats) -> NDArray[np.bool_]:
    """Tell whether their shadows on all four axes overlap, (m,)."""
    axes = np.concatenate([np.broadcast_to(_axes(mine), (len(others), 2, 2)), _axes(others)], axis=1)
    low_1, high_1 = _shadow(np.broadcast_to(_corners(mine), (len(others), 4, 2)), axes)
    low_2, high_2 = _shadow(_corners(others), axes)
    return np.asarray(((low_1 < high_2) & (low_2 < high_1)).all(axis=1))


def _shadow(corners: Floats, axes: Floats) -> tuple[Floats, Floats]:
    along = corners @ axes.swapaxes(1, 2)  # (m, 4 corners, 4 axes)
    return along.min(axis=1), along.max(axis=1)
