"""From a floor plan and a light to a world in MuJoCo."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import NDArray

from worlds import textures
from worlds.frame import Frame, quaternion
from worlds.illuminate import illuminate
from worlds.light import LightSetting, Photometry, photometry
from worlds.schema import Board, Cabinet, Door, Fixture, FloorPlan, Material, Point, Poster, Wall, Window
from worlds.site import SOLID, Block, Site, Span

SKIN = 0.004
"""How far a picture stands in front of its wall [m]: enough for the depth buffer at 100 m."""
SLAB = 0.3
"""Thickness of the ceiling [m]; sunlight must not find a way in."""
PLASTER_SIZE = (4.0, 2.8)
PLASTERS = 3
ROOM_DEPTH = 2.5
"""Depth of the room behind an open door [m]; a choice, plans do not say."""


@dataclass(frozen=True, slots=True)
class World:
    """A world that is ready for a robot: attach one to ``spec`` and compile.

    ``routes`` maps names to waypoints, (n, 2) [m], read-only. ``photometry`` tells how much light there is.
    """

    name: str
    spec: mujoco.MjSpec
    plan: FloorPlan
    light: LightSetting
    seed: int
    routes: Mapping[str, NDArray[np.float64]]
    photometry: Photometry


def build(plan: FloorPlan, light: LightSetting, seed: int) -> World:
    """Put up the walls, hang everything on them and light it; ``seed`` fixes every texture."""
    site = Site(plan.name, seed)
    numbers = photometry(plan, light)
    _view(site, plan)
    _materials(site, plan)
    _floor(site, plan)
    _ceiling(site, plan)
    for wall in plan.wall:
        _wall(site, plan, wall)
    _hang(site, plan)
    illuminate(site, plan, light, numbers)
    routes = MappingProxyType({name: _frozen(points) for name, points in plan.routes.items()})
    return World(plan.name, site.spec, plan, light, seed, routes, numbers)


def _frozen(points: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    array = np.array(points, dtype=float)
    array.setflags(write=False)
    return array


def _view(site: Site, plan: FloorPlan) -> None:
    """Set near and far plane, and a headlight that makes do where there is no photometric light.

    Filament spreads its one shadow map over all that lies before the far plane (what is behind it is drawn all the
    same): a far plane just beyond the walls gives the sharpest sun patches.
    """
    spec = site.spec
    low, high = plan.bounds
    spec.stat.extent = float(np.linalg.norm(high - low))
    spec.visual.map.znear = 0.05 / spec.stat.extent
    spec.visual.map.zfar = 1.1
    spec.visual.headlight.ambient[:] = 0.5
    spec.visual.headlight.diffuse[:] = 0.4
    spec.visual.headlight.specular[:] = 0.0


def _materials(site: Site, plan: FloorPlan) -> None:
    for name, material in plan.material.items():
        site.plain(name, material)
    site.plain("trim", Material(albedo=0.12, roughness=0.6))
    site.plain("frame", Material(albedo=0.6, roughness=0.5))
    for name in {w.material for w in plan.wall}:
        for i in range(PLASTERS):
            key = f"{name}_plaster_{i}"
            site.texture(key, textures.plaster(PLASTER_SIZE, plan.material[name].albedo, site.rng(key)))
    for name, width, height in {(d.material, d.width, d.height) for d in plan.door}:
        material, key = plan.material[name], _leaf_material(name, width, height)
        site.picture(key, textures.wood((width, height), material.albedo, site.rng(key)), material.roughness)


def _leaf_material(name: str, width: float, height: float) -> str:
    return f"{name}_leaf_{width:g}x{height:g}"


# --- floor and ceiling ---


def _floor(site: Site, plan: FloorPlan) -> None:
    low, high = plan.bounds
    tile, material = plan.floor.tile, plan.material[plan.floor.material]
    size = high - low
    columns, rows = _drawn(size, tile, 40)
    site.texture("floor", textures.tiles((columns, rows), material.albedo, site.rng("floor")))
    repeat = size / (tile * np.array([columns, rows]))
    site.papered("floor_tiles", "floor", material.roughness, repeat)
    site.spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[*(low + high) / 2, 0.0],
        size=[*size / 2, 1.0],
        material="floor_tiles",
        group=SOLID,
        castshadow=False,
    )


def _drawn(size: NDArray[np.float64], each: float, most: int) -> tuple[int, int]:
    """Columns and rows of tiles to draw before they repeat, at most ``most``: a wide floor takes no larger picture."""
    columns, rows = (max(1, min(round(side / each), most)) for side in size)
    return columns, rows


def _ceiling(site: Site, plan: FloorPlan) -> None:
    low, high = plan.bounds
    panel, height, material = plan.ceiling.panel, plan.ceiling.height, plan.material[plan.ceiling.material]
    size = high - low
    columns, rows = _drawn(size, panel, 20)
    site.texture("ceiling", textures.ceiling_panels((columns, rows), material.albedo, site.rng("ceiling")))
    site.papered("ceiling_panels", "ceiling", material.roughness, size / (panel * np.array([columns, rows])))
    middle = (low + high) / 2
    site.plane("ceiling_face", [*middle, height], quaternion([1, 0, 0], [0, 0, -1]), tuple(size), "ceiling_panels")
    margin = 0.5
    level = Frame(middle, np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    (x, y), z = size / 2 + margin, (height + SKIN, height + SLAB)
    site.solid("ceiling_slab", level, ((-x, x), (-y, y), z), plan.ceiling.material)


# --- walls and their openings ---


def _wall(site: Site, plan: FloorPlan, wall: Wall) -> None:
    frame = Frame.of(wall)
    openings = sorted((o for o in (*plan.window, *plan.door) if o.wall == wall.name), key=lambda o: o.at)
    skirting: list[Block] = []
    for i, (s, z) in enumerate(_pieces(wall, openings, plan.ceiling.height, _reach(plan, wall))):
        material = _plastered(site, plan, wall, i, s, z)
        site.solid(f"wall_{wall.name}_{i}", frame, (s, (-wall.thickness, 0.0), z), material)
        if z[0] == 0.0:
            skirting.append((s, (0.0, 0.012), (0.0, 0.08)))
    site.lattice(f"wall_{wall.name}_skirting", frame, skirting, "trim", cast=False)


def _reach(plan: FloorPlan, wall: Wall) -> Span:
    """Tell how far a wall goes on past its start and past its end [m].

    Past a corner by its thickness, so that two walls leave no gap for light; but not past a corner where the next wall
    turns away from the room: there it would stand out into the room behind that wall's face.
    """
    inward = Frame.of(wall).inward

    def past(corner: Point) -> float:
        at_corner = [w for w in plan.wall if w != wall and corner in (w.start, w.end)]
        far_ends = [w.end if w.start == corner else w.start for w in at_corner]
        turns_away = any(np.subtract(end, corner) @ inward < 0.0 for end in far_ends)
        return 0.0 if turns_away else wall.thickness

    return past(wall.start), past(wall.end)


def _pieces(wall: Wall, openings: list[Window | Door], height: float, reach: Span) -> Iterator[tuple[Span, Span]]:
    """Cut a wall into upright pieces between openings, and what is below and above each opening."""
    begin = -reach[0]
    for opening in openings:
        first, last = opening.extent
        yield (begin, first), (0.0, height)
        bottom, top = opening.rise
        if bottom > 0.0:
            yield (first, last), (0.0, bottom)
        if top < height:
            yield (first, last), (top, height)
        begin = last
    yield (begin, wall.length + reach[1]), (0.0, height)


def _plastered(site: Site, plan: FloorPlan, wall: Wall, piece: int, s: Span, z: Span) -> str:
    key = f"wall_{wall.name}_{piece}"
    choice = int(site.rng(key).integers(PLASTERS))
    repeat = ((s[1] - s[0]) / PLASTER_SIZE[0], (z[1] - z[0]) / PLASTER_SIZE[1])
    return site.papered(key, f"{wall.material}_plaster_{choice}", plan.material[wall.material].roughness, repeat)


# --- what hangs on the walls and stands against them ---


def _hang(site: Site, plan: FloorPlan) -> None:
    def frame(item: object) -> Frame:
        return Frame.of(plan.wall_named(item.wall))  # type: ignore[attr-defined]

    for window in plan.window:
        _window(site, frame(window), window, plan.wall_named(window.wall).thickness)
    for door in plan.door:
        _door(site, frame(door), door, plan)
    for poster in plan.poster:
        _poster(site, frame(poster), poster)
    for board in plan.board:
        _board(site, frame(board), board)
    for cabinet in plan.cabinet:
        _cabinet(site, frame(cabinet), cabinet, plan.material[cabinet.material])
    for bin_ in plan.bin:
        _upright_cylinder(
            site, f"bin_{bin_.name}", frame(bin_), bin_.at, bin_.width / 2, (0.0, bin_.height), bin_.material
        )
    for fixture in plan.fixture:
        _fixture(site, frame(fixture), fixture)


def _window(site: Site, frame: Frame, window: Window, thickness: float) -> None:
    (a, b), (low, high) = window.extent, window.rise
    bar, depth = 0.06, (-thickness + 0.02, -thickness + 0.09)
    bars: list[Block] = [((a, b), depth, (low, low + bar)), ((a, b), depth, (high - bar, high))]
    uprights = np.linspace(a + bar / 2, b - bar / 2, window.panes + 1)
    bars += [((s - bar / 2, s + bar / 2), depth, (low, high)) for s in uprights]
    site.lattice(f"window_{window.name}", frame, bars, "frame")
    ledge = ((a - 0.05, b + 0.05), (-thickness + 0.09, 0.03), (low, low + 0.02))
    site.shown(f"window_{window.name}_ledge", frame, ledge, "frame", cast=True)


def _door(site: Site, frame: Frame, door: Door, plan: FloorPlan) -> None:
    (a, b), jamb, proud = door.extent, 0.05, 0.015
    reach = (-door.recess, proud)
    site.lattice(
        f"door_{door.name}_frame",
        frame,
        [
            ((a - jamb, a + 0.015), reach, (0.0, door.height + jamb)),
            ((b - 0.015, b + jamb), reach, (0.0, door.height + jamb)),
            ((a + 0.015, b - 0.015), reach, (door.height - 0.015, door.height + jamb)),
        ],
        "trim",
    )
    _leaf(site, frame, door)
    if door.open > 0.0:
        _room_behind(site, frame, door, plan.wall_named(door.wall), plan.ceiling.height)
    if door.label:
        _number_plate(site, frame, door)


def _leaf(site: Site, frame: Frame, door: Door) -> None:
    """Hang the leaf on its hinge; opened, it swings into the room behind."""
    at_start = door.hinge == "start"
    hinge = frame if at_start else frame.reversed()
    s = door.extent[0] if at_start else -door.extent[1]
    leaf = hinge.turned(s, -door.recess, np.radians(door.open))
    material = _leaf_material(door.material, door.width, door.height)
    block = ((0.0, door.width), (-0.04, 0.0), (0.0, door.height))
    site.solid(f"door_{door.name}_leaf", leaf, block, material)


def _room_behind(site: Site, frame: Frame, door: Door, wall: Wall, height: float) -> None:
    """Close off what is seen through an open door: a bare room."""
    a, b = door.extent[0] - 0.6, door.extent[1] + 0.6
    near, far = -wall.thickness, -wall.thickness - ROOM_DEPTH
    name, t = f"door_{door.name}_room", 0.1
    site.solid(f"{name}_back", frame, ((a - t, b + t), (far - t, far), (0.0, height)), wall.material)
    site.solid(f"{name}_start", frame, ((a - t, a), (far, near), (0.0, height)), wall.material)
    site.solid(f"{name}_end", frame, ((b, b + t), (far, near), (0.0, height)), wall.material)
    site.shown(
        f"{name}_ceiling", frame, ((a - t, b + t), (far - t, near), (height, height + t)), wall.material, cast=True
    )
    site.shown(f"{name}_floor", frame, ((a - t, b + t), (far - t, 0.0), (-t, -0.001)), wall.material)


def _number_plate(site: Site, frame: Frame, door: Door) -> None:
    key, size = f"door_{door.name}_plate", (0.16, 0.12)
    material = site.picture(key, textures.number_plate(door.label, site.rng(key)), 0.4)
    s = door.extent[1] + 0.17
    site.panel(key, frame, (s - size[0] / 2, s + size[0] / 2), SKIN, (1.5, 1.5 + size[1]), material)


def _poster(site: Site, frame: Frame, poster: Poster) -> None:
    key = f"poster_{poster.name}"
    image = textures.poster((poster.width, poster.height), poster.style, site.rng(key))
    site.panel(key, frame, poster.extent, SKIN, poster.rise, site.picture(key, image, 0.7))


def _board(site: Site, frame: Frame, board: Board) -> None:
    key = f"board_{board.name}"
    image = textures.notice_board((board.width, board.height), board.sheets, site.rng(key))
    site.panel(key, frame, board.extent, 2 * SKIN, board.rise, site.picture(key, image, 0.9))


def _cabinet(site: Site, frame: Frame, cabinet: Cabinet, material: Material) -> None:
    key = f"cabinet_{cabinet.name}"
    site.solid(key, frame, (cabinet.extent, (0.0, cabinet.depth), cabinet.rise), cabinet.material)
    image = textures.metal((cabinet.width, cabinet.height), material.albedo, site.rng(key))
    front = site.picture(f"{key}_front", image, material.roughness)
    site.panel(f"{key}_front", frame, cabinet.extent, cabinet.depth + SKIN, cabinet.rise, front)


def _upright_cylinder(site: Site, name: str, frame: Frame, s: float, radius: float, z: Span, material: str) -> None:
    site.spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=frame.point(s, radius + 0.02, (z[0] + z[1]) / 2),
        size=[radius, (z[1] - z[0]) / 2, 0.0],
        material=material,
        group=SOLID,
        castshadow=True,
    )


def _fixture(site: Site, frame: Frame, fixture: Fixture) -> None:
    key, block = f"{fixture.kind}_{fixture.name}", (fixture.extent, (0.0, fixture.depth), fixture.rise)
    if fixture.kind == "extinguisher":
        _upright_cylinder(site, key, frame, fixture.at, fixture.width / 2, fixture.rise, fixture.material)
        return
    site.solid(key, frame, block, fixture.material)
    if fixture.kind == "radiator":
        site.lattice(f"{key}_fins", frame, _fins(fixture), fixture.material, cast=False)
    if fixture.kind == "sign":
        image = textures.sign((fixture.width, fixture.height), site.rng(key))
        material = site.picture(f"{key}_face", image, 0.4)
        site.panel(f"{key}_face", frame, fixture.extent, fixture.depth + SKIN, fixture.rise, material)


def _fins(fixture: Fixture) -> list[Block]:
    pitch, (first, last), (low, high) = 0.06, fixture.extent, fixture.rise
    out = (fixture.depth, fixture.depth + 0.015)
    return [((s, s + 0.035), out, (low + 0.03, high - 0.03)) for s in np.arange(first + 0.02, last - 0.04, pitch)]
