import mujoco
import pytest

from worlds.build import World, build
from worlds.light import light_named
from worlds.photometry import transmission, window_luminance
from worlds.plan import load_plan

PLAN = load_plan("hallway")


def lights(world: World) -> dict[str, mujoco.MjsLight]:
    return {light.name: light for light in world.spec.lights}


def test_only_the_sun_casts_shadows(hallway: World) -> None:
    assert [n for n, light in lights(hallway).items() if light.castshadow] == ["sun"]


def test_intensities_are_photometric(hallway: World) -> None:
    found, numbers = lights(hallway), hallway.photometry
    sun = found["sun"]
    assert sun.intensity * sun.diffuse[0] == pytest.approx(transmission(PLAN) * numbers.outdoors.direct)
    window = found["window_w01"]
    candela = window_luminance(PLAN, PLAN.window[0], numbers.outdoors) * 0.85 * 2.0 * 1.5
    assert window.intensity * window.diffuse[0] == pytest.approx(candela, rel=1e-5)


def test_the_evening_has_lamps_and_no_sun() -> None:
    small = PLAN.model_copy(update={"poster": (), "board": (), "window": PLAN.window[:2]})
    found = lights(build(small, light_named("late-evening"), seed=0))
    assert "sun" not in found
    assert sum(n.startswith("lamp_") for n in found) == 25
