"""Lamps that no world stands behind, against Filament's own light and the laws that it follows."""

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.rendering.baked.model_lights import bake_lamps, sun_of
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.lighting.baking import Shell
from refseq_bench.worlds.lighting.form_factors import Cards
from tests.sim.rendering.test_renderers import ALBEDO, SUN, card

POINT = '<light type="point" pos="0 0 {height}" intensity="100" diffuse="1 1 1" range="{reach}" castshadow="false"/>'
SPOT = (
    '<light type="spot" pos="0.2 0.1 2.5" dir="0.1 0 -1" intensity="500" diffuse="1 1 1" range="50" cutoff="{cutoff}" '
    'softness="{softness}" castshadow="false"/>'
)
UP = np.array([0.0, 0.0, 1.0])
WIDTH, HEIGHT = 160, 120


def on_floor(model: mujoco.MjModel, points: np.ndarray) -> np.ndarray:
    """Light on cards that look up [lx], half of them asked as the shell's and half as others."""
    cards = Cards(points, np.tile(UP, (len(points), 1)))
    half = len(points) // 2
    shell = Shell(np.zeros((0, 3, 3)), np.zeros(0), cards[:half], np.zeros((0, 3), np.intp))
    light = bake_lamps(model, shell, cards[half:])
    assert not light.buried.any()
    return np.concatenate([light.lux, light.around])


@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
@pytest.mark.parametrize(
    "lamp",
    [
        POINT.format(height=2, reach=50),
        POINT.format(height=2, reach=2.2),
        *(SPOT.format(cutoff=cutoff, softness=softness) for cutoff, softness in ((25, 0.2), (25, 0.9), (60, 0.5))),
    ],
)
def test_a_lamp_lights_the_floor_as_filament_lights_it(lamp: str) -> None:
    model, data = card(lamp)
    with open_renderer(RendererKind.FILAMENT, model) as renderer:
        drawn = renderer.radiance(data, "down", WIDTH, HEIGHT) * np.pi / ALBEDO
    # The camera is 3 m up, and 40° high.
    pixel = 2 * 3 * np.tan(np.radians(20)) / HEIGHT
    columns, rows = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, HEIGHT / 2 - np.arange(HEIGHT) - 0.5)
    points = np.column_stack([columns.ravel() * pixel, rows.ravel() * pixel, np.zeros(columns.size)])
    found = on_floor(model, points).reshape(HEIGHT, WIDTH)
    assert drawn.std() > 0.1 * drawn.max()
    # Filament keeps a cone's two numbers in 16 bits each: where its edge is sharp that is 2 %.
    np.testing.assert_allclose(found, drawn, atol=0.03 * drawn.max())


@pytest.mark.parametrize("share", [0.25, 0.5, 0.9])
def test_a_lamp_fades_towards_its_range(share: float) -> None:
    """Filament's documentation, 'Attenuation function': (1 − (d / r)⁴)² beside the inverse square."""
    lit, faded = (
        on_floor(card(POINT.format(height=2, reach=reach))[0], np.zeros((1, 3)))[0] for reach in (1e6, 2 / share)
    )
    assert lit == pytest.approx(100 / 2**2)
    assert faded / lit == pytest.approx((1 - share**4) ** 2)


def test_beyond_its_range_and_its_cone_and_from_behind_a_lamp_gives_nothing() -> None:
    assert on_floor(card(POINT.format(height=2, reach=1.9))[0], np.zeros((1, 3)))[0] == 0.0
    assert on_floor(card(POINT.format(height=-2, reach=50))[0], np.zeros((1, 3)))[0] == 0.0
    beside = np.array([[0.45, 0.1, 0.0], [0.45 + 2.5 * np.tan(np.radians(31)), 0.1, 0.0]])
    inside, outside = on_floor(card(SPOT.format(cutoff=25, softness=0.2))[0], beside)
    assert (inside > 50, outside) == (True, 0.0)


def test_the_sun_is_the_first_that_shines_and_lies_against_its_way() -> None:
    off, low = SUN.format(dir="0 1 -1", shadow="true"), SUN.format(dir="3 0 -4", shadow="false")
    model, _ = card(off + low)
    model.light_active[0] = 0
    sun = sun_of(model)
    assert (sun.lux, sun.shadows) == (1000.0, False)
    assert sun.towards == pytest.approx([-0.6, 0.0, 0.8])
    assert sun_of(card("")[0]).lux == 0.0
