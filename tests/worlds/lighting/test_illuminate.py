from functools import partial

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.photometry import transmission, window_luminance
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.parts.greyscale import srgb
from refseq_bench.worlds.plans.frame import quaternion
from refseq_bench.worlds.plans.load import load_plan

PLAN = load_plan("hallway")


def lights(world: World) -> dict[str, mujoco.MjsLight]:
    return {light.name: light for light in world.spec.lights}


def test_only_the_sun_casts_shadows(hallway: World) -> None:
    assert [n for n, light in lights(hallway).items() if light.castshadow] == ["sun"]


def test_a_world_has_no_settings_of_a_renderer(hallway: World) -> None:
    """Its bench sets them when it compiles the world: ``prepare_spec`` leaves what is there."""
    assert [number.name for number in hallway.spec.numerics] == []


def test_intensities_are_photometric(hallway: World) -> None:
    found, numbers = lights(hallway), hallway.photometry
    sun = found["sun"]
    assert sun.intensity * sun.diffuse[0] == pytest.approx(transmission(PLAN) * numbers.outdoors.direct)
    window = found["window:w01"]
    candela = window_luminance(PLAN, PLAN.window[0], numbers.outdoors) * 0.85 * 2.0 * 1.5
    assert window.intensity * window.diffuse[0] == pytest.approx(candela, rel=1e-5)


def test_the_evening_has_lamps_and_no_sun() -> None:
    small = PLAN.model_copy(update={"poster": (), "board": (), "window": PLAN.window[:2]})
    found = lights(build_world(small, light_named("late-evening"), seed=0))
    assert "sun" not in found
    assert sum(n.startswith("lamp:") for n in found) == 25


# --- what a renderer makes of it ---

RHO = 0.5
CARDS = {
    "wall opposite a window": ((20, 1.19, 1.3), (0, -1, 0)),
    "below it": ((22, 1.19, 0.4), (0, -1, 0)),
    "floor by a window": ((24, 0, 0.01), (0, 0, 1)),
    "floor far from windows": ((33.5, 0, 0.01), (0, 0, 1)),
    "wall in the sun": ((33.5, 1.19, 1.3), (0, -1, 0)),
}


def with_cards(world: World) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The world with small grey cards, and a camera 0.3 m in front of each."""
    spec = world.spec.copy()
    grey = float(srgb(RHO))
    spec.add_material(name="card", rgba=[grey, grey, grey, 1.0], roughness=1.0, metallic=0.0, specular=0.0)
    for name, (point, normal) in CARDS.items():
        across = (0, 1, 0) if normal[1] == 0 else (1, 0, 0)
        turn, size = quaternion(across, normal), [0.1, 0.1, 1.0]
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            pos=point,
            quat=turn,
            size=size,
            material="card",
            castshadow=False,
        )
        spec.worldbody.add_camera(name=name, pos=np.add(point, 0.3 * np.array(normal)), quat=turn, fovy=10.0)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
def test_rendered_cards_are_nearly_as_bright_as_the_meter_says(hallway: World) -> None:
    # The camera stands on the centre line: what the image light is there, it is on the walls, too.
    model, data = with_cards(hallway)
    meter = Meter(hallway.plan, hallway.light)
    with open_renderer("filament", model) as renderer:
        for name, (point, normal) in CARDS.items():
            renderer.light_around(partial(hallway.ambient.at, (point[0], 0.0)))
            luminance = float(np.median(renderer.radiance(data, name, 32, 24)))
            assert luminance * np.pi / RHO == pytest.approx(meter.read(point, normal).total, rel=0.2), name
