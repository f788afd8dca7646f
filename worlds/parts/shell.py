"""The shell of a building: floor, ceiling, walls with what is cut out of them."""

import math
from collections.abc import Iterator
from functools import partial
from itertools import groupby
from types import MappingProxyType

import mujoco
import numpy as np

from refseq_bench.worlds.arrays import Block, Floats, Span
from refseq_bench.worlds.parts import scenery, textures
from refseq_bench.worlds.parts.site import TOUCHED, TRIM, Site
from refseq_bench.worlds.plans.areas import JOINED, Rectangle, rectangles
from refseq_bench.worlds.plans.frame import LEVEL, LocalFrame, quaternion
from refseq_bench.worlds.plans.schema import Door, FloorPlan, Point, Wall, Window

PROUD = 0.004
"""Distance by which a picture stands in front of what is behind it [m]: enough for the depth buffer at 100 m."""
SLAB = 0.3
"""Thickness of the ceiling [m]; sunlight must not find a way in."""
LEAST = 1e-9
"""Least width and height of a piece of wall [m]: where two openings touch there is none between them."""
OVERHANG = 0.5
"""Length that the ceiling goes on past the walls' inner faces [m]."""
PLASTER_SIZE = (4.0, 2.8)
"""Width and height of a picture of plaster [m]."""
PLASTERS = 3
"""So many pictures are drawn of a surface: pieces of wall choose one."""
FLOORS = MappingProxyType(
    {
        "tiles": textures.tiles,
        "carpet": textures.carpet,
        "parquet": textures.parquet,
        "asphalt": scenery.asphalt,
    }
)
"""Drawing of each pattern of a floor: (columns, rows) of tiles, albedo, generator."""
WALLS = MappingProxyType({"plaster": textures.plaster, "brick": scenery.brick, "hedge": scenery.hedge})
"""Drawing of each surface of a wall."""


def raise_shell(site: Site, plan: FloorPlan) -> None:
    """Lay the floor, put up the walls with their openings, and the ceiling on top where there is one."""
    _plasters(site, plan)
    _floor(site, plan)
    if plan.ceiling is not None:
        _ceiling(site, plan)
    for wall in plan.wall:
        _wall(site, plan, wall)


def _plasters(site: Site, plan: FloorPlan) -> None:
    for name, surface in sorted({(w.material, w.surface) for w in plan.wall}):
        for i in range(PLASTERS):
            key = f"material:{name}:{surface}:{i}"
            site.texture(key, partial(WALLS[surface], PLASTER_SIZE, plan.material[name].albedo, site.rng(key)))


# --- floor and ceiling ---


def _floor(site: Site, plan: FloorPlan) -> None:
    """One endless plane that is touched, and a picture on each part of the ground."""
    low, high = plan.bounds
    middle, size = [*(low + high) / 2, 0.0], [*(high - low) / 2, 1.0]
    site.shape("floor", mujoco.mjtGeom.mjGEOM_PLANE, middle, size, "", TOUCHED)
    tile, material = plan.floor.tile, plan.material[plan.floor.material]
    drawn = _drawn(high - low, tile, 40)
    site.texture("floor", partial(FLOORS[plan.floor.pattern], drawn, material.albedo, site.rng("floor")))
    for i, area in enumerate(rectangles(plan)):
        name = site.papered(f"floor:{i}", "floor", material, area.size / (tile * np.array(drawn)))
        site.plane(name, [*area.middle, 0.0], quaternion([1, 0, 0], [0, 0, 1]), tuple(area.size), name)


def _drawn(size: Floats, each: float, most: int) -> tuple[int, int]:
    """Columns and rows of tiles to draw before they repeat, at most ``most``: a wide floor takes no larger picture."""
    columns, rows = (max(1, min(round(side / each), most)) for side in size)
    return columns, rows


def _ceiling(site: Site, plan: FloorPlan) -> None:
    """On each part of the ground a picture that looks down, and a slab that keeps the sun out."""
    panel, height, material = plan.roof.panel, plan.roof.height, plan.material[plan.roof.material]
    low, high = plan.bounds
    drawn = _drawn(high - low, panel, 20)
    site.texture("ceiling", partial(textures.ceiling_panels, drawn, material.albedo, site.rng("ceiling")))
    for i, area in enumerate(rectangles(plan)):
        name = site.papered(f"ceiling:{i}", "ceiling", material, area.size / (panel * np.array(drawn)))
        site.plane(name, [*area.middle, height], quaternion([1, 0, 0], [0, 0, -1]), tuple(area.size), name)
        site.solid(f"{name}:slab", LEVEL, _slab(area, height), plan.roof.material)


def _slab(area: Rectangle, height: float) -> Block:
    (x0, y0), (x1, y1) = area.low - OVERHANG, area.high + OVERHANG
    return (x0, x1), (y0, y1), (height + PROUD, height + SLAB)


# --- walls and their openings ---


def _wall(site: Site, plan: FloorPlan, wall: Wall) -> None:
    frame = LocalFrame.of(wall)
    openings = plan.openings_in(wall)
    skirting: list[Block] = []
    pieces = _pieces(wall, openings, plan.wall_height(wall), _reach(plan, wall))
    for i, (s, z) in enumerate(piece for piece in pieces if min(np.ptp(piece, axis=1)) > LEAST):
        material = _plastered(site, plan, wall, i, s, z)
        site.solid(f"wall:{wall.name}:{i}", frame, (s, (-wall.thickness, 0.0), z), material)
        if z[0] == 0.0:
            skirting.append((s, (0.0, 0.012), (0.0, 0.08)))
    if skirting:
        site.lattice(f"wall:{wall.name}:skirting", frame, skirting, TRIM, cast=False)


def _reach(plan: FloorPlan, wall: Wall) -> Span:
    """Tell how far a wall goes on past its start and past its end [m].

    Past a corner by its thickness, so that two walls leave no gap for light; but not past a corner where the next wall
    turns away from the room: there it would stand out into the room behind that wall's face.
    """
    inward = LocalFrame.of(wall).inward

    def past(corner: Point) -> float:
        ends = [pair for w in plan.wall if w != wall for pair in ((w.start, w.end), (w.end, w.start))]
        far_ends = [far for near, far in ends if math.dist(near, corner) <= JOINED]
        turns_away = any(np.subtract(end, corner) @ inward < -JOINED for end in far_ends)
        return 0.0 if turns_away else wall.thickness

    return past(wall.start), past(wall.end)


def _pieces(wall: Wall, openings: list[Window | Door], height: float, reach: Span) -> Iterator[tuple[Span, Span]]:
    """Cut a wall into upright pieces between openings, and what is below, between and above openings."""
    begin = -reach[0]
    for (first, last), above in groupby(openings, key=lambda o: o.extent):
        yield (begin, first), (0.0, height)
        floor = 0.0
        for bottom, top in sorted(o.rise for o in above):
            if bottom > floor:
                yield (first, last), (floor, bottom)
            floor = top
        if floor < height:
            yield (first, last), (floor, height)
        begin = last
    yield (begin, wall.length + reach[1]), (0.0, height)


def _plastered(site: Site, plan: FloorPlan, wall: Wall, piece: int, s: Span, z: Span) -> str:
    key = f"wall:{wall.name}:{piece}"
    choice = int(site.rng(key).integers(PLASTERS))
    repeat = ((s[1] - s[0]) / PLASTER_SIZE[0], (z[1] - z[0]) / PLASTER_SIZE[1])
    return site.papered(key, f"material:{wall.material}:{wall.surface}:{choice}", plan.material[wall.material], repeat)
