"""Windows and doors, and the rooms behind open doors."""

from functools import partial

import numpy as np

from refseq_bench.worlds.arrays import Block
from refseq_bench.worlds.parts import posters, textures
from refseq_bench.worlds.parts.shell import PROUD
from refseq_bench.worlds.parts.site import FRAME, TRIM, Site
from refseq_bench.worlds.plans.footprints import ROOM_SIDE, ROOM_WALL
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Door, FloorPlan, Material, Wall, Window

PLATE = Material(albedo=0.75, roughness=0.4)


def cut_openings(site: Site, plan: FloorPlan) -> None:
    """Glaze the windows and hang the doors."""
    for name, width, height in sorted({(d.material, d.width, d.height) for d in plan.door}):
        key, material = _leaf_material(name, width, height), plan.material[name]
        site.picture(key, partial(textures.wood, (width, height), material.albedo, site.rng(key)), material)
    for window in plan.window:
        wall = plan.wall_named(window.wall)
        _window(site, LocalFrame.of(wall), window, wall.thickness)
    for door in plan.door:
        _door(site, LocalFrame.of(plan.wall_named(door.wall)), door, plan)


def _leaf_material(name: str, width: float, height: float) -> str:
    return f"material:{name}:leaf:{width:g}x{height:g}"


def _window(site: Site, frame: LocalFrame, window: Window, thickness: float) -> None:
    (a, b), (low, high) = window.extent, window.rise
    bar, depth = 0.06, (-thickness + 0.02, -thickness + 0.09)
    glass = (-thickness + 0.05, -thickness + 0.06)
    bars: list[Block] = [((a, b), depth, (low, low + bar)), ((a, b), depth, (high - bar, high))]
    uprights = np.linspace(a + bar / 2, b - bar / 2, window.panes + 1)
    bars += [((s - bar / 2, s + bar / 2), depth, (low, high)) for s in uprights]
    site.lattice(f"window:{window.name}", frame, bars, FRAME)
    ledge = ((a - 0.05, b + 0.05), (-thickness + 0.09, 0.03), (low, low + 0.02))
    site.shown(f"window:{window.name}:ledge", frame, ledge, FRAME, cast=True)
    site.pane(f"window:{window.name}:pane", frame, ((a, b), glass, (low, high)))


def _door(site: Site, frame: LocalFrame, door: Door, plan: FloorPlan) -> None:
    (a, b), jamb, proud = door.extent, 0.05, 0.015
    wall = plan.wall_named(door.wall)
    reach = (-door.recess, proud)
    site.lattice(
        f"door:{door.name}:frame",
        frame,
        [
            ((a - jamb, a + 0.015), reach, (0.0, door.height + jamb)),
            ((b - 0.015, b + jamb), reach, (0.0, door.height + jamb)),
            ((a + 0.015, b - 0.015), reach, (door.height - 0.015, door.height + jamb)),
            ((a, b), (-wall.thickness, 0.0), (-0.05, 0.003)),  # the threshold: the floor ends at the wall's face
        ],
        TRIM,
    )
    _leaf(site, frame, door)
    if door.open > 0.0:
        _room_behind(site, frame, door, wall, plan.wall_height(wall))
    if door.label:
        _number_plate(site, frame, door)


def _leaf(site: Site, frame: LocalFrame, door: Door) -> None:
    """Hang the leaf on its hinge; opened, it swings into the room behind."""
    leaf = frame.leaf(door, float(np.radians(door.open)))
    material = _leaf_material(door.material, door.width, door.height)
    block = ((0.0, door.width), (-0.04, 0.0), (0.0, door.height))
    site.solid(f"door:{door.name}:leaf", leaf, block, material)


def _room_behind(site: Site, frame: LocalFrame, door: Door, wall: Wall, height: float) -> None:
    """Close off what is seen through an open door: a bare room."""
    a, b = door.extent[0] - ROOM_SIDE, door.extent[1] + ROOM_SIDE
    near, far = -wall.thickness, -wall.thickness - door.depth
    name, t = f"door:{door.name}:room", ROOM_WALL
    site.solid(f"{name}:back", frame, ((a - t, b + t), (far - t, far), (0.0, height)), wall.material)
    site.solid(f"{name}:start", frame, ((a - t, a), (far, near), (0.0, height)), wall.material)
    site.solid(f"{name}:end", frame, ((b, b + t), (far, near), (0.0, height)), wall.material)
    site.shown(
        f"{name}:ceiling", frame, ((a - t, b + t), (far - t, near), (height, height + t)), wall.material, cast=True
    )
    site.shown(f"{name}:floor", frame, ((a - t, b + t), (far - t, 0.0), (-t, -0.001)), wall.material)


def _number_plate(site: Site, frame: LocalFrame, door: Door) -> None:
    key, size = f"door:{door.name}:plate", (0.16, 0.12)
    material = site.picture(key, partial(posters.number_plate, door.label, site.rng(key)), PLATE)
    s = door.extent[1] + 0.17
    site.panel(key, frame, (s - size[0] / 2, s + size[0] / 2), PROUD, (1.5, 1.5 + size[1]), material)
