"""Where the rendered sun falls, against where geometry puts it."""

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

WINDOW = 'window = [{ name = "w", wall = "right", at = 4 }]'
ENDS = "".join(
    f'[[wall]]\nname = "{name}"\nstart = [{x}, -1.2]\nend = [{x}, 1.2]\ninside = "{inside}"\nmaterial = "plaster"\n'
    for name, x, inside in (("start", 0, "right"), ("end", 8, "left"))
)
INNER, OUTER = -1.2, -1.5
"""y of the faces of the wall that the window is in [m]."""
SIDE = 240
HEIGHT = 2.75
BLUR = 0.04
"""Texels of the shadow map and pixels of the picture [m]."""


def floor_points() -> NDArray[np.float64]:
    """Points of the floor that the pixels of a square picture of 90° show, from above (4, 0), (SIDE, SIDE, 2) [m]."""
    across = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    x, y = np.meshgrid(4 + HEIGHT * across, -HEIGHT * across)
    return np.stack([x, y], axis=-1)


def sunlit(points: NDArray[np.float64], beam: NDArray[np.float64], grown: float) -> NDArray[np.bool_]:
    """Whether the way from the floor back to the sun leads through the opening, grown by so much, at both faces."""
    lit = np.ones(points.shape[:2], bool)
    for face in (INNER, OUTER):
        steps = (face - points[..., 1]) / -beam[1]
        x, z = points[..., 0] - steps * beam[0], -steps * beam[2]
        lit &= (steps > 0) & (np.abs(x - 4) <= 1 + grown) & (z >= 0.9 - grown) & (z <= 2.4 + grown)
    return lit


KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    pytest.param(RendererKind.BAKED, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
]


@pytest.mark.quick_cases("16:00-filament")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("hour", ["13:00", "16:00"])
def test_the_sun_falls_through_a_window_to_where_geometry_puts_it(hour: str, kind: RendererKind) -> None:
    world = build_world(parse_plan(SMALL.format(top=WINDOW, end=ENDS)), light_named(hour), seed=0)
    world.spec.worldbody.add_camera(name="above", pos=[4, 0, HEIGHT], fovy=90.0)
    prepare_spec(world.spec)
    model = world.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open_renderer(kind, model) as renderer:
        picture = renderer.radiance(data, "above", SIDE, SIDE)
    points = floor_points()
    on_floor = np.abs(points[..., 1]) < 1.1
    outdoors = world.photometry.outdoors
    beam = sun_direction(outdoors, world.plan.place.x_azimuth)
    albedo = world.plan.material["plaster"].albedo
    sun = albedo / np.pi * 0.76 * outdoors.direct * -beam[2]
    lit = (picture > 0.6 * sun) & on_floor
    may, must = (sunlit(points, beam, grown) & on_floor for grown in (BLUR, -BLUR))
    assert must.sum() > 500
    assert not (lit & ~may).any()
    # Within, only the window's bars throw shade: 6 cm on each side and in the middle, as wide as the sun is low.
    assert lit[must].mean() > 0.8
