"""Build a MuJoCo world of a floor plan in a light."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from types import MappingProxyType

import mujoco
import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import LightSetting
from refseq_bench.worlds.lighting.ambient import Ambient
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.illuminate import BACKDROP, illuminate
from refseq_bench.worlds.lighting.photometry import Photometry, photometry
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.parts.cars import park_cars
from refseq_bench.worlds.parts.fittings import hang_fittings
from refseq_bench.worlds.parts.furniture import furnish
from refseq_bench.worlds.parts.openings import cut_openings
from refseq_bench.worlds.parts.outdoors import furnish_grounds
from refseq_bench.worlds.parts.people import place_people
from refseq_bench.worlds.parts.shell import raise_shell
from refseq_bench.worlds.parts.site import FRAME, TRIM, Site
from refseq_bench.worlds.parts.stairs import raise_stairs
from refseq_bench.worlds.plans.schema import FloorPlan, Material


@dataclass(frozen=True, slots=True)
class World:
    """A world that is ready for a robot: attach one to ``spec`` and compile.

    ``routes`` maps names to waypoints, (n, 2) [m], read-only. ``photometry`` tells which sources shine, and
    ``ambient`` the illuminance that the image light should give around a camera, by place, worked out once it is asked.
    One that is not ``pictured`` has nothing for cameras to see.
    """

    name: str
    spec: mujoco.MjSpec = field(repr=False)
    plan: FloorPlan = field(repr=False)
    light: LightSetting
    seed: int
    routes: Mapping[str, Floats] = field(repr=False)
    photometry: Photometry = field(repr=False)
    ambient: Ambient = field(repr=False)
    pictured: bool = True


def build_world(plan: FloorPlan, light: LightSetting, seed: int = 0, *, pictured: bool = True) -> World:
    """Put up the walls, hang everything on them and light it; ``seed`` fixes every texture.

    A world that is not ``pictured`` has neither pictures nor light between its walls. It is ready in a fraction of the
    time, and nothing but a camera notices: it is for drives without any. Raises ``WorldsError`` for a seed below 0.
    """
    if seed < 0:
        raise WorldsError(f"world {plan.name!r}: seed = {seed} is not valid; it should be 0 or more")
    site = Site(plan.name, seed, pictured)
    numbers = photometry(plan, light)
    _view(site, plan)
    _materials(site, plan)
    raise_shell(site, plan)
    cut_openings(site, plan)
    hang_fittings(site, plan)
    raise_stairs(site, plan)
    furnish(site, plan)
    park_cars(site, plan)
    furnish_grounds(site, plan)
    place_people(site, plan)
    around = illuminate(site, plan, numbers, partial(_for_camera, plan, light) if pictured else None)
    routes = MappingProxyType({name: _frozen(points) for name, points in plan.routes.items()})
    return World(plan.name, site.spec, plan, light, seed, routes, numbers, around, pictured)


def _for_camera(plan: FloorPlan, light: LightSetting, cards: Cards) -> Floats:
    return Meter(plan, light).for_camera(cards)


def _frozen(points: tuple[tuple[float, float], ...]) -> Floats:
    array = np.array(points, dtype=float)
    array.setflags(write=False)
    return array


def _view(site: Site, plan: FloorPlan) -> None:
    """Set near and far plane, and a headlight that makes do where there is no photometric light.

    Filament spreads its one shadow map over all that lies before the far plane: one just beyond the walls, or beyond
    the picture outside the windows where there are some, gives the sharpest sun patches.
    """
    spec = site.spec
    low, high = plan.bounds
    spec.stat.extent = float(np.linalg.norm(high - low))
    spec.visual.map.znear = 0.05 / spec.stat.extent
    outside = BACKDROP if plan.window else 0.0
    spec.visual.map.zfar = 1.1 * (1.0 + outside / spec.stat.extent)
    spec.visual.headlight.ambient[:] = 0.5
    spec.visual.headlight.diffuse[:] = 0.4
    spec.visual.headlight.specular[:] = 0.0


def _materials(site: Site, plan: FloorPlan) -> None:
    for name, material in plan.material.items():
        site.plain(name, material)
    site.plain(TRIM, Material(albedo=0.12, roughness=0.6))
    site.plain(FRAME, Material(albedo=0.6, roughness=0.5))
