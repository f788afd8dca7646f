"""Check a built world: all is there, nothing stands in anything else, and robots get through.

It looks at the compiled model, at the same solids that robots touch and laser beams end on.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import LightSetting
from refseq_bench.worlds.plans.areas import crowded_corners, enclosing
from refseq_bench.worlds.plans.schema import TABLES, FloorPlan, Point, Wall

TOLERANCE = 0.01
"""Things may stand so far in each other [m]: what is drawn to the centimetre may be off by one. A choice."""
CLEARANCE = 0.05
"""A robot's box is grown by so much on all sides [m]: no robot keeps to its route exactly. A choice; where it
turns on the spot, as here at every bend, it takes more room than one that rounds them."""
GROUND = 0.03
"""A robot rolls over things that are lower than this [m]."""
STRIDE, SWING = 0.1, np.radians(10.0)
"""A robot is put down at least every so many metres of a route, and so often while it turns [rad]."""
MOST = 100
"""Findings of a kind that are told: who has more has one mistake many times. A choice."""
SHELL = ("wall", "door", "")
"""Tables of what may stand in each other by design."""
PROBE = "check_probe"
"""Name of the box that stands for a robot."""


@dataclass(frozen=True, slots=True)
class RobotBox:
    """A robot as a box, [m]: from ``back`` behind to ``front`` before the point that follows a route; ``height`` up."""

    name: str
    front: float
    back: float
    half_width: float
    height: float


@dataclass(frozen=True, slots=True)
class Checkup:
    """Findings, one line each, and the costs of the world.

    ``more`` is the number of those that are not told: of each kind the first ``MOST`` are, and of overlaps beyond these
    the pairs of things are counted whose boxes meet. ``seconds`` to build and compile it, ``megabytes`` of the compiled
    model, its number of ``geoms`` and of ``solids``.
    """

    findings: tuple[str, ...]
    more: int
    seconds: float
    megabytes: float
    geoms: int
    solids: int


def check_world(plan: FloorPlan, light: LightSetting, robots: Sequence[RobotBox] = (), seed: int = 0) -> Checkup:
    """Put up a world and look for things that are missing, that overlap, and that stand on a route."""
    begun = time.perf_counter()
    spec = build_world(plan, light, seed).spec
    model = spec.compile()
    seconds = time.perf_counter() - begun
    solids = _solids(model)
    things = _plan_items(plan)
    overlaps, unmeasured = _overlapping(model, plan, things, solids)
    kinds = [
        list(_not_enclosed(plan)),
        list(_missing(model, things)),
        overlaps,
        [line for robot in robots for line in _blocked(spec, plan, things, robot)],
    ]
    findings = tuple(line for kind in kinds for line in kind[:MOST])
    more = sum(map(len, kinds)) - len(findings) + unmeasured
    return Checkup(findings, more, seconds, mujoco.mj_sizeModel(model) / 1e6, model.ngeom, len(solids))


# --- is the building closed? ---


def _not_enclosed(plan: FloorPlan) -> Iterator[str]:
    """Find where walls up to the ceiling leave the building open, or do not tell what of it they enclose."""
    walls = plan.full_walls
    if plan.ceiling is None or enclosing(plan):
        return
    if ends := list(_open_ends(walls)):
        yield from ends
    elif all(0.0 in np.subtract(wall.end, wall.start) for wall in walls):
        crowded = [f"{_ending(walls, (x, y))} end at x {x:.2f}, y {y:.2f}" for x, y in crowded_corners(plan)]
        where = f": {'; '.join(crowded[:4])}" if crowded else ""
        yield (
            f"walls up to the ceiling enclose no one area{where}; floor and ceiling fill the rectangle around them "
            "all: valid is an outline whose walls meet two by two, with partitions inside it"
        )


def _ending(walls: Sequence[Wall], corner: Point) -> str:
    """Names of the walls that end in a corner; of more than four the first ones."""
    near = [one for one in walls if min(math.dist(corner, end) for end in (one.start, one.end)) <= 2 * TOLERANCE]
    return f"walls {', '.join(repr(one.name) for one in near[:4])}{' and others' * (len(near) > 4)}"


def _open_ends(walls: Sequence[Wall]) -> Iterator[str]:
    """Find ends of walls that meet no other one."""
    for wall in walls:
        others = [other for other in walls if other is not wall]
        for x, y in (wall.start, wall.end):
            if all(_from_wall((x, y), other) > TOLERANCE for other in others):
                yield f"wall '{wall.name}' meets no other one at x {x:.2f}, y {y:.2f}: the building is open there"


def _from_wall(point: tuple[float, float], wall: Wall) -> float:
    """Distance of a point from the inner face of a wall, to its ends [m]."""
    way, to = np.subtract(wall.end, wall.start), np.subtract(point, wall.start)
    share = np.clip(to @ way / (way @ way), 0.0, 1.0)
    return float(np.linalg.norm(to - share * way))


# --- whose is a geom? ---


class _PlanItem(NamedTuple):
    """Something of the plan; what is in no table, such as the ceiling's slab, has none."""

    table: str
    name: str
    kind: str

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}'"


def _plan_items(plan: FloorPlan) -> dict[str, _PlanItem]:
    """All things by what the names of their geoms begin with: their table's or their kind's word, and their name."""
    found: dict[str, _PlanItem] = {}
    for table in TABLES:
        for item in getattr(plan, table):
            thing = _PlanItem(table, item.name, getattr(item, "kind", table))
            found |= {f"{word}:{item.name}": thing for word in (table, thing.kind)}
    return found


def _owner(geom: str, things: dict[str, _PlanItem]) -> _PlanItem:
    """The thing that a geom belongs to: its name's first two words are the thing's."""
    return things.get(":".join(geom.split(":")[:2]), _PlanItem("", geom, "part"))


def _told(thing: _PlanItem, geom: str) -> str:
    """A thing as findings name it; the room behind an open door belongs to the door, and is not it."""
    return f"the room behind {thing}" if geom.startswith(f"door:{thing.name}:room:") else str(thing)


def _missing(model: mujoco.MjModel, things: dict[str, _PlanItem]) -> Iterator[str]:
    names = [model.geom(i).name for i in range(model.ngeom)] + [model.body(i).name for i in range(model.nbody)]
    there = {_owner(name, things) for name in names}
    for thing in dict.fromkeys(things.values()):
        if thing not in there:
            yield f"{thing} is in the plan, but not in the world"


# --- do things stand in each other? ---


def _solids(model: mujoco.MjModel) -> NDArray[np.intp]:
    """Numbers of the geoms that are touched, without the endless floor."""
    touched = (model.geom_contype | model.geom_conaffinity) != 0
    return np.flatnonzero(touched & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))


def geom_boxes(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Floats, Floats]:
    """Return low and high corners of the boxes around all geoms, along the world's axes, (ngeom, 3) each [m]."""
    turns = data.geom_xmat.reshape(-1, 3, 3)
    middle = data.geom_xpos + np.einsum("gij,gj->gi", turns, model.geom_aabb[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(turns), model.geom_aabb[:, 3:])
    return middle - half, middle + half


def _overlapping(
    model: mujoco.MjModel, plan: FloorPlan, things: dict[str, _PlanItem], solids: NDArray[np.intp]
) -> tuple[list[str], int]:
    """Tell of each two things that stand in each other where they do most, of the first ``MOST`` pairs of things.

    The second is the number of other pairs whose boxes meet: to measure all would take the square of the things.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    hung = {(door.name, door.wall) for door in plan.door}
    owners = [_owner(model.geom(g).name, things) for g in range(model.ngeom)]
    near = _near(model, data, solids)
    numbers = {owner: k for k, owner in enumerate(dict.fromkeys(owners))}
    number = np.array([numbers[owner] for owner in owners])
    pairs = number[near] @ (len(numbers), 1)  # one number for two things
    worst: dict[int, tuple[float, str]] = {}

    def measure(at: int) -> None:
        a, b = near[at].tolist()
        if _built_together(owners[a], owners[b], hung):
            return
        depth, (x, y, z) = _depth(model, data, a, b)
        if depth > max(TOLERANCE, worst.get(pairs[at], (0.0,))[0]):
            where = f"at x {x:.2f}, y {y:.2f}, z {z:.2f}"
            parts = " and ".join(_told(owners[k], model.geom(k).name) for k in (a, b))
            worst[pairs[at]] = depth, f"{parts} overlap by {depth:.2f} m {where}"

    end = 0
    while end < len(near) and len(worst) < MOST:
        measure(end)
        end += 1
    known = np.isin(pairs[end:], list(worst))
    for at in np.flatnonzero(known).tolist():
        measure(end + at)
    _, first = np.unique(pairs[end:][~known], return_index=True)
    left = near[end:][~known][first]
    left = left[number[left[:, 0]] != number[left[:, 1]]]
    return [line for _, line in worst.values()], len(left) - _built_in(left, owners, hung)


def _built_in(pairs: NDArray[np.intp], owners: Sequence[_PlanItem], hung: set[tuple[str, str]]) -> int:
    """Count the pairs of geoms (n, 2) that belong together by design: those of the shell alone are looked at."""
    of_shell = np.array([owner.table in SHELL for owner in owners])
    built = (_built_together(owners[a], owners[b], hung) for a, b in pairs[of_shell[pairs].all(axis=1)].tolist())
    return sum(built)


def _depth(model: mujoco.MjModel, data: mujoco.MjData, a: int, b: int) -> tuple[float, Floats]:
    """Return how far one geom must be moved to leave the other [m], and where they overlap, (3,) [m]."""
    ends = np.zeros(6)
    return -mujoco.mj_geomDistance(model, data, a, b, 1.0, ends), (ends[:3] + ends[3:]) / 2


def _near(model: mujoco.MjModel, data: mujoco.MjData, solids: NDArray[np.intp]) -> NDArray[np.intp]:
    """Pairs of solids whose boxes overlap by more than the tolerance, (n, 2)."""
    low, high = (corners[solids] for corners in geom_boxes(model, data))
    meet = np.all(low[:, None] < high[None] - TOLERANCE, axis=2)
    return solids[np.argwhere(np.triu(meet & meet.T, 1))]


def _built_together(one: _PlanItem, other: _PlanItem, hung: set[tuple[str, str]]) -> bool:
    """Tell whether two solids belong together: of one thing, of the shell, or of a door and the wall around it."""
    match {one.table, other.table}:
        case tables if tables <= {"wall", ""}:
            return True
        case tables if tables == {"wall", "door"}:
            door, wall = (one, other) if one.table == "door" else (other, one)
            return (door.name, wall.name) in hung
    return one == other


# --- do robots get through? ---


def _blocked(spec: mujoco.MjSpec, plan: FloorPlan, things: dict[str, _PlanItem], robot: RobotBox) -> Iterator[str]:
    """Lead the robot's box along each route; each thing that it touches is told once a route."""
    model = _with_probe(spec, robot)
    data = mujoco.MjData(model)
    for route, points in plan.routes.items():
        touched: dict[str, tuple[float, float]] = {}
        for x, y, heading in _poses(np.array(points)):
            for geom in _touched(model, data, x, y, heading):
                touched.setdefault(_told(_owner(geom, things), geom), (x, y))
        for thing, (x, y) in touched.items():
            yield f"route '{route}': robot '{robot.name}' does not get past {thing} at x {x:.2f}, y {y:.2f}"


def _with_probe(spec: mujoco.MjSpec, robot: RobotBox) -> mujoco.MjModel:
    """The world and in it a free box as large as the robot."""
    world = spec.copy()
    body = world.worldbody.add_body(name=PROBE)
    body.add_freejoint()
    length, height = (robot.front + robot.back) / 2 + CLEARANCE, robot.height - GROUND
    middle = [(robot.front - robot.back) / 2, 0.0, GROUND + height / 2]
    size = [length, robot.half_width + CLEARANCE, height / 2]
    body.add_geom(name=PROBE, type=mujoco.mjtGeom.mjGEOM_BOX, pos=middle, size=size, mass=1.0)
    return world.compile()


def _poses(points: Floats) -> Iterator[tuple[float, float, float]]:
    """Places and headings along a route, (x, y, heading) [m, rad]; at each bend it turns on the spot."""
    steps = np.diff(points, axis=0)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    for (start, end), heading, after in zip(pairwise(points), headings, [*headings[1:], None], strict=True):
        count = max(2, int(np.ceil(np.linalg.norm(end - start) / STRIDE)) + 1)
        yield from ((float(x), float(y), float(heading)) for x, y in np.linspace(start, end, count))
        if after is not None:
            turn = (after - heading + np.pi) % (2 * np.pi) - np.pi
            for part in np.linspace(0.0, turn, int(np.ceil(abs(turn) / SWING)) + 1):
                yield float(end[0]), float(end[1]), float(heading + part)


def _touched(model: mujoco.MjModel, data: mujoco.MjData, x: float, y: float, heading: float) -> set[str]:
    """Names of the geoms that the probe touches there."""
    data.qpos[-7:] = [x, y, 0.0, np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    probe = model.geom(PROBE).id
    pairs = [set(pair) for pair in data.contact.geom.tolist()]
    return {model.geom((pair - {probe}).pop()).name for pair in pairs if probe in pair}
