"""Symbols of what a plan holds, as an architect draws them: walls cut and filled, doors with their swing, furniture."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.drawing.style import FILLS, INK, PURPLE, SKY, Style, arrow, box, disc, fill, label, line
from refseq_bench.worlds.plans.areas import enclosing, rectangles
from refseq_bench.worlds.plans.footprints import Footprint, corners, footprints
from refseq_bench.worlds.plans.frame import LocalFrame, left_of
from refseq_bench.worlds.plans.schema import Door, Fixture, FloorPlan, LampRow, Person, Stairs, Tree, Wall, Window

SHEET_DEPTH, BOARD_DEPTH, LEAST_DEPTH = 0.12, 0.2, 0.1
"""Drawn thickness of posters, boards and small things [m], so that they are seen."""


def draw_things(axes: Axes, plan: FloorPlan) -> None:
    """Draw all of a plan but its routes, from the ground up."""
    around = enclosing(plan)
    for wall in around:
        _wall(axes, plan, wall, wall.thickness, zorder=1.0)
    for area in rectangles(plan):
        fill(axes, box(area.low, area.high), facecolor="white" if plan.ceiling else "#f4f4f4", zorder=2.0)
    for wall in plan.wall:
        if wall not in around:
            _wall(axes, plan, wall, 0.0, zorder=2.5)
    _ground_lines(axes, plan)
    for row in plan.lamp:
        _lamps(axes, row)
    _standing(axes, plan)
    _on_walls(axes, plan)


def _wall(axes: Axes, plan: FloorPlan, wall: Wall, past: float, zorder: float) -> None:
    """Fill a wall between its openings. It goes on ``past`` its ends; inside the room the floor covers that."""
    frame, begin = LocalFrame.of(wall), -past
    solid: Style = {"facecolor": INK, "edgecolor": INK, "zorder": zorder}
    for opening in plan.openings_in(wall):
        fill(axes, _slab(frame, (begin, opening.extent[0]), (-wall.thickness, 0.0)), **solid)
        begin = opening.extent[1]
    fill(axes, _slab(frame, (begin, wall.length + past), (-wall.thickness, 0.0)), f"wall_{wall.name}", **solid)


def _ground_lines(axes: Axes, plan: FloorPlan) -> None:
    for table in ("marking", "kerb"):
        for item in getattr(plan, table):
            for a, b in pairwise(np.array(item.points)):
                aside = left_of((b - a) / np.linalg.norm(b - a)) * item.width / 2
                style = {
                    **FILLS[table],
                    "facecolor": str(0.6 + 0.4 * plan.material[item.material].albedo),
                    "zorder": 2.8,
                }
                fill(axes, [a + aside, b + aside, b - aside, a - aside], f"{table}_{item.name}", **style)


def _lamps(axes: Axes, row: LampRow) -> None:
    half = np.array(row.size) / 2
    for middle in row.positions:
        fill(axes, box(middle - half, middle + half), f"lamp_{row.name}", **FILLS["lamp"], zorder=3.0)


def _standing(axes: Axes, plan: FloorPlan) -> None:
    for tree in plan.tree:
        disc(axes, tree.at, tree.crown, f"tree_{tree.name}", **FILLS["tree"], zorder=3.5)
    for table in ("furniture", "stairs", "car", "tree", "post"):
        for item in getattr(plan, table):
            style = FILLS["pillar" if isinstance(item, Tree) or getattr(item, "kind", "") == "pillar" else table]
            for shape in footprints(plan, item):
                _footprint(axes, shape, f"{table}_{item.name}", style)
    for flight in plan.stairs:
        _treads(axes, flight)
    for car in plan.car:
        _windscreen(axes, footprints(plan, car)[0])
    for person in plan.person:
        _person(axes, person)


def _footprint(axes: Axes, shape: Footprint, name: str, style: Style) -> None:
    if not shape.length:
        disc(axes, (shape.x, shape.y), shape.radius, name, **style)
        return
    fill(axes, corners(shape), name, **style)


def _local(shape: Footprint, points: ArrayLike) -> Floats:
    """Points in shares of a footprint's half sides as points of the plan, (n, 2) [m]."""
    cos, sin = np.cos(shape.heading), np.sin(shape.heading)
    scaled = np.asarray(points, dtype=float) * [shape.length, shape.width]
    return scaled @ np.array([[cos, sin], [-sin, cos]]) + [shape.x, shape.y]


def _treads(axes: Axes, flight: Stairs) -> None:
    """A line for each step, and an arrow that points up."""
    frame, half = LocalFrame.under(flight), flight.width / 2
    for k in range(1, flight.steps):
        line(axes, [frame.point(k * flight.run, out, 0.0)[:2] for out in (-half, half)], linewidth=0.3)
    top, foot = (frame.point(k * flight.run, 0.0, 0.0)[:2] for k in (flight.steps - 0.3, 0.3))
    arrow(axes, top, foot, zorder=4.5)


def _windscreen(axes: Axes, shape: Footprint) -> None:
    line(axes, _local(shape, [(0.35, -0.8), (0.45, 0.0), (0.35, 0.8)]))
    line(axes, _local(shape, [(-0.7, -0.8), (-0.7, 0.8)]))


def _person(axes: Axes, person: Person) -> None:
    line(axes, person.path, color=PURPLE, linestyle=":", linewidth=0.7)
    disc(axes, person.at, 0.25, f"person_{person.name}", **FILLS["person"])
    heading = np.radians(person.heading)
    at, ahead = np.array(person.at), np.array([np.cos(heading), np.sin(heading)])
    line(axes, np.array([at, at + 0.4 * ahead]), linewidth=0.8)


def _on_walls(axes: Axes, plan: FloorPlan) -> None:
    for window in plan.window:
        _window(axes, plan.wall_named(window.wall), window)
    for door in plan.door:
        _door(axes, plan.wall_named(door.wall), door)
    for cabinet in plan.cabinet:
        _footprint(axes, footprints(plan, cabinet)[0], f"cabinet_{cabinet.name}", FILLS["cabinet"])
    for one in plan.bin:
        _footprint(axes, footprints(plan, one)[0], f"bin_{one.name}", FILLS["bin"])
    for table, depth in (("poster", SHEET_DEPTH), ("board", BOARD_DEPTH)):
        for item in getattr(plan, table):
            frame = LocalFrame.of(plan.wall_named(item.wall))
            fill(axes, _slab(frame, item.extent, (0.0, depth)), f"{table}_{item.name}", **FILLS[table], zorder=4.2)
    for fixture in plan.fixture:
        _fixture(axes, LocalFrame.of(plan.wall_named(fixture.wall)), fixture)


def _fixture(axes: Axes, frame: LocalFrame, fixture: Fixture) -> None:
    name, depth = f"fixture_{fixture.name}", max(fixture.depth, LEAST_DEPTH)
    if fixture.kind == "extinguisher":
        disc(axes, frame.point(fixture.at, depth / 2, 0.0)[:2], depth / 2, name, **FILLS["extinguisher"])
        return
    fill(axes, _slab(frame, fixture.extent, (0.0, depth)), name, **FILLS[fixture.kind], zorder=4.1)


def _window(axes: Axes, wall: Wall, window: Window) -> None:
    frame, thick = LocalFrame.of(wall), wall.thickness
    opening = _slab(frame, window.extent, (-thick, 0.0))
    fill(axes, opening, f"window_{window.name}", facecolor="white", edgecolor=INK, zorder=2.6)
    glass = [frame.point(s, -0.7 * thick, 0.0)[:2] for s in window.extent]
    line(axes, glass, color=SKY, linewidth=1.4)


def _door(axes: Axes, wall: Wall, door: Door) -> None:
    """The opening, the leaf as it stands, the quarter circle that it swings through, and the number."""
    frame = LocalFrame.of(wall)
    fill(axes, _slab(frame, door.extent, (-wall.thickness, 0.0)), facecolor="white", edgecolor="none", zorder=2.6)
    angles = np.radians(np.linspace(0.0, max(90.0, door.open), 24))
    tips = [frame.leaf(door, float(angle)).point(door.width, 0.0, 0.0)[:2] for angle in angles]
    line(axes, tips, color="#888888", linewidth=0.35, linestyle="-" if door.open else ":")
    leaf = frame.leaf(door, float(np.radians(door.open)))
    fill(axes, _slab(leaf, (0.0, door.width), (-0.04, 0.0)), f"door_{door.name}", facecolor=INK, edgecolor=INK)
    beyond = door.width + 0.15 if door.open else 0.45
    middle = frame.point(door.at, -wall.thickness - beyond, 0.0)[:2]
    turn = 90.0 if abs(frame.along[1]) > abs(frame.along[0]) else 0.0
    label(axes, middle, door.label or door.name, rotation=turn, clip_on=True, zorder=6)


def _slab(frame: LocalFrame, s: tuple[float, float], out: tuple[float, float]) -> Floats:
    """Corners of a rectangle between two distances along a wall and two out of it, (4, 2) [m]."""
    return np.array([frame.point(s[i], out[j], 0.0)[:2] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
