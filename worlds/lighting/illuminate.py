"""The lights of a world, in photometric units, and what glows: lamps, and the picture outside the windows.

The panes themselves are not built: glass takes its share of the light (``GLAZING``) but no geom, so the sun falls
through the openings and what is outside moves behind them as the robot passes.
"""

from functools import partial

import numpy as np

from refseq_bench.worlds.lighting.ambient import Ambient, Measure, ambient
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.lighting.lights import add_image_light, add_spot, add_sun
from refseq_bench.worlds.lighting.open_air import illuminate_open_air
from refseq_bench.worlds.lighting.outlook import SKY_BY_DAY, SKY_BY_NIGHT, outside
from refseq_bench.worlds.lighting.photometry import (
    CUTOFF,
    LAMP_DEPTH,
    NIGHT_PEAK,
    REACH,
    Photometry,
    Spot,
    spots,
    transmission,
)
from refseq_bench.worlds.parts.site import Site
from refseq_bench.worlds.plans.frame import LEVEL, LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, Material, Wall

FAINTEST = 0.01
"""Windows of less intensity than this [cd] are left out."""
UNASKED = 30.0
"""Luminance of the light between the walls [cd/m²] until a renderer is told that of a place; a choice: as by day.

That one is slow to work out, and most renderers never ask."""
BACKDROP = 20.0
"""Distance of the picture outside from the wall [m]."""
OVERHANG = 70.0
"""Length of the picture beyond the wall's ends [m]: a window 0.3 m deep shows no more."""
STOREY = 5.0
"""Depth of the picture below the floor [m]: the hallway is on the first floor."""
SKYLINE = 20.0
"""Height of the picture [m]; above and beside it there is bare sky."""
SKY_HEIGHT = 120.0
"""Height of the sky behind the picture [m]."""


def illuminate(site: Site, plan: FloorPlan, numbers: Photometry, measure: Measure | None) -> Ambient:
    """Add the sun, the windows, the lamps, the light between the walls and the picture outside.

    ``measure`` tells all light but the direct sun, once that is asked for; without it there is none between the walls.
    Returns that light by place.
    """
    site.spec.visual.quality.shadowsize = 1024
    sun = transmission(plan) * numbers.outdoors.direct
    if sun > 0.0:
        add_sun(site, sun, sun_direction(numbers.outdoors, plan.place.x_azimuth))
    if plan.ceiling is None:
        return illuminate_open_air(site, plan, numbers)
    shining = spots(plan, numbers)
    around = ambient(plan, measure, shining) if measure else Ambient.even(0.0)
    add_image_light(site, "between_walls", (255,) * 6, UNASKED if measure else 0.0)
    for spot in shining:
        _spot(site, spot)
    _lamps(site, plan, numbers)
    _outside(site, plan, numbers)
    return around


def _spot(site: Site, spot: Spot) -> None:
    """A window or lamp that points into the room."""
    if spot.candela >= FAINTEST:
        add_spot(site, spot.name, spot.kind, spot.candela, spot.pos, spot.axis, CUTOFF, 1.0, REACH)


def _lamps(site: Site, plan: FloorPlan, numbers: Photometry) -> None:
    """The lamps' bodies; the faces of those that burn have the luminance Φ / (π A), as a camera sees it."""
    for row in plan.lamp:
        width, depth = row.size
        material = f"lamp:{row.name}"
        if row in numbers.lit_rows:
            site.glowing(material, camera_weight(row.kelvin) * row.lumen / (np.pi * width * depth))
        else:
            site.plain(material, Material(albedo=0.75, roughness=0.6))
        for i, (x, y) in enumerate(row.positions):
            up = (plan.roof.height - LAMP_DEPTH, plan.roof.height)
            block = ((x - width / 2, x + width / 2), (y - depth / 2, y + depth / 2), up)
            site.shown(f"lamp:{row.name}:{i}", LEVEL, block, material)


def _outside(site: Site, plan: FloorPlan, numbers: Photometry) -> None:
    day = not numbers.outdoors.night
    peak = transmission(plan) * numbers.outdoors.sky / np.pi / SKY_BY_DAY if day else NIGHT_PEAK
    for wall in plan.wall:
        if any(w.wall == wall.name for w in plan.window):
            _backdrop(site, wall, peak, day)


def _backdrop(site: Site, wall: Wall, peak: float, day: bool) -> None:
    key, frame = f"outside:{wall.name}", LocalFrame.of(wall)
    width, pixels = wall.length + 2 * OVERHANG, (8192, 640)
    site.glowing(key, peak, partial(outside, *pixels, STOREY / SKYLINE, day, site.rng(key)))
    site.glowing(f"{key}:sky", peak * (SKY_BY_DAY if day else SKY_BY_NIGHT))
    turn, away, middle = frame.panel_quat, -wall.thickness - BACKDROP, wall.length / 2
    site.plane(key, frame.point(middle, away, SKYLINE / 2 - STOREY), turn, (width, SKYLINE), key)
    sky = frame.point(middle, away - 0.5, SKY_HEIGHT / 2 - STOREY)
    site.plane(f"{key}:sky", sky, turn, (3 * width, SKY_HEIGHT), f"{key}:sky")
