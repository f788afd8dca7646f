"""Floors of known geometry, with doorways, closed doors, leaves and clutter, and what a scanner can see of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, wrap
from tests.refseq.rooms import Wall, rays, rectangle

Point = NDArray[np.float64]
BESIDE = (0.05, 0.15, 0.3)
"""Where a wall beside a doorway must be seen for the doorway to be in sight [m]."""
RECESS = 0.08
"""How far a leaf lies behind the wall's face [m]."""
WIDTHS = (0.7, 0.8, 0.9, 1.0, 1.2, 1.6)


class Leaf(Enum):
    """The leaf of a doorway: none, or by the angle that it is open [deg]."""

    NONE = None
    OPEN = 90.0
    AJAR = 25.0
    CLOSED = 0.0


@dataclass(frozen=True)
class Doorway:
    """A doorway in a wall's face from ``start`` to ``end``, (2,) [m], seen from the wall's left side."""

    start: Point
    end: Point
    leaf: Leaf
    beside: NDArray[np.float64]
    """Spots on the face beside it, (n, 2)."""

    @property
    def centre(self) -> Point:
        return (self.start + self.end) / 2

    @property
    def width(self) -> float:
        return math.dist(self.start, self.end)

    @property
    def passable(self) -> bool:
        """Whether 0.6 m fit through: between the leaf and the jamb across from its hinge, where there is a leaf."""
        return self.leaf is Leaf.NONE or self.width * math.sin(math.radians(self.leaf.value)) > 0.6


@dataclass(frozen=True)
class Floor:
    """A room of ``size`` [m] with a corner in the origin, in a hall; ``walls`` are all faces that stop a beam."""

    size: tuple[float, float]
    walls: list[Wall]
    sides: list[Wall]
    doorways: list[Doorway]
    clutter: NDArray[np.float64]
    """Centres of what stands in the room, (n, 2)."""

    def pose(self, rng: np.random.Generator) -> Pose:
        """Somewhere in the room, half a metre and more from walls and clutter."""
        while True:
            x, y = rng.uniform(0.5, np.array(self.size) - 0.5)
            if (np.hypot(*(self.clutter - [x, y]).T) > 0.9).all():
                return Pose(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))


def random_floor(rng: np.random.Generator) -> Floor:
    """A room or, every other time, a corridor; doors of all widths and states, and up to four boxes."""
    size = (rng.uniform(12, 25), rng.uniform(1.8, 2.6)) if rng.random() < 0.5 else tuple(rng.uniform(4, 9, 2))
    thickness = rng.uniform(0.1, 0.2)
    sides = rectangle(0, 0, *size)
    walls = rectangle(-3, -3, size[0] + 3, size[1] + 3)
    doorways: list[Doorway] = []
    for side in sides:
        faces, doors = wall_with_doors(side, door_places(rng, math.dist(side[:2], side[2:])), thickness)
        walls += faces
        doorways += doors
    clutter = np.zeros((0, 2))
    for _ in range(rng.integers(5)):
        spot = rng.uniform(0.4, np.array(size) - 0.4)
        if all(math.dist(spot, door.centre) > 0.7 + door.width / 2 for door in doorways):
            walls += box(spot, rng.uniform(0.2, 0.6), rng.uniform(0, np.pi))
            clutter = np.vstack([clutter, spot])
    return Floor(size, walls, sides, doorways, clutter)


def door_places(rng: np.random.Generator, length: float) -> list[tuple[float, float, Leaf]]:
    """Doors along a wall: from, to [m], leaf; now and then one is a hand's breadth from the corner."""
    places = []
    at = 0.1 if rng.random() < 0.15 else rng.uniform(0.4, 2.5)
    while (to := at + float(rng.choice(WIDTHS))) < length - 0.4:
        leaf = rng.choice(np.array(list(Leaf)), p=(0.35, 0.15, 0.2, 0.3))
        places.append((at, to, leaf))
        at = to + rng.uniform(0.4, 4.0)
    return places


def wall_with_doors(
    side: Wall, places: Sequence[tuple[float, float, Leaf]], thickness: float
) -> tuple[list[Wall], list[Doorway]]:
    """Faces of a wall whose room is on its left, with reveals, back and leaves, and its doorways."""
    origin, far = np.array(side[:2]), np.array(side[2:])
    length = math.dist(origin, far)
    along = (far - origin) / length
    behind = np.array([along[1], -along[0]])

    def spot(at: float, depth: float = 0.0) -> Point:
        return origin + at * along + depth * behind

    faces, doorways = [], []
    edges = [0.0, *(edge for start, to, _ in places for edge in (start, to)), length]
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        faces += [line(spot(a), spot(b)), line(spot(a, thickness), spot(b, thickness))]
    for start, to, leaf in places:
        faces += [line(spot(edge), spot(edge, thickness)) for edge in (start, to)]
        beside = [spot(s) for d in BESIDE for s in (start - d, to + d) if 0 < s < length]
        doorways.append(Doorway(spot(start), spot(to), leaf, np.array(beside)))
        if leaf.value is not None:
            angle = math.radians(leaf.value)
            hinge = spot(start, RECESS)
            faces.append(line(hinge, hinge + (to - start) * (math.cos(angle) * along + math.sin(angle) * behind)))
    return faces, doorways


def box(centre: Point, size: float, angle: float) -> list[Wall]:
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    corners = centre + size / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ turn
    return [line(a, b) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]


def line(a: Point, b: Point) -> Wall:
    return (float(a[0]), float(a[1]), float(b[0]), float(b[1]))


def visible(walls: Sequence[Wall], pose: Pose, spots: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which spots, (n, 2), lie in front of the scanner with nothing between."""
    offsets = spots - [pose.x, pose.y]
    angles = np.arctan2(offsets[:, 1], offsets[:, 0])
    ahead = np.array([abs(wrap(angle - pose.heading)) < math.radians(89) for angle in angles])
    return ahead & (rays(walls, pose, angles) > np.hypot(*offsets.T) - 0.01)


def in_sight(floor: Floor, door: Doorway, pose: Pose) -> bool:
    """Whether both jambs and all of the gap are seen, at 4° and more and from the front."""
    share = np.linspace(0.05, 0.95, 7)[:, None]
    spots = np.concatenate([door.beside, (1 - share) * door.start + share * door.end])
    if not visible(floor.walls, pose, spots).all():
        return False
    ends = [math.atan2(end[1] - pose.y, end[0] - pose.x) for end in (door.start, door.end)]
    return abs(wrap(ends[1] - ends[0])) > math.radians(4)
