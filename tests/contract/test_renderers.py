"""What holds for every renderer: many at once, one after another, and in workers of their own."""

import multiprocessing

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import Renderer, RendererKind

KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    pytest.param(RendererKind.BAKED, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
    pytest.param(RendererKind.CLASSIC, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
]
SIZE = (64, 48)


def scene(albedo: float = 0.5) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A lit wall with a box before it."""
    spec = mujoco.MjSpec()
    spec.add_material(name="grey", rgba=[albedo, albedo, albedo, 1.0], specular=0.0)
    box = mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(name="wall", type=box, pos=[2.0, 0.0, 0.0], size=[0.1, 2.0, 2.0], material="grey")
    spec.worldbody.add_geom(name="box", type=box, pos=[1.2, 0.2, 0.0], size=[0.1, 0.2, 0.3], material="grey")
    spec.worldbody.add_camera(name="eye", xyaxes=[0, -1, 0, 0, 0, 1])
    spec.worldbody.add_light(pos=[0.0, 0.5, 0.5], dir=[1.0, -0.2, -0.2], intensity=500.0, cutoff=80.0)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def drawn(kind: RendererKind, albedo: float = 0.5) -> NDArray[np.float32]:
    """A frame by a renderer of its own; also what a worker runs."""
    model, data = scene(albedo)
    with open_renderer(kind, model) as renderer:
        return renderer.radiance(data, "eye", *SIZE)


@pytest.mark.parametrize("kind", KINDS)
def test_two_renderers_in_one_process_do_not_disturb_each_other(kind: RendererKind) -> None:
    bright, dim = (drawn(kind, albedo) for albedo in (0.7, 0.3))
    assert bright.mean() > 1.3 * dim.mean()
    models = [scene(albedo) for albedo in (0.7, 0.3)]
    with open_renderer(kind, models[0][0]) as first, open_renderer(kind, models[1][0]) as second:
        for _ in range(2):
            np.testing.assert_array_equal(first.radiance(models[0][1], "eye", *SIZE), bright)
            np.testing.assert_array_equal(second.radiance(models[1][1], "eye", *SIZE), dim)


@pytest.mark.parametrize("kind", KINDS)
def test_one_that_closes_leaves_the_other_at_work(kind: RendererKind) -> None:
    model, data = scene()
    staying = open_renderer(kind, model)
    with staying, open_renderer(kind, scene()[0]) as leaving:
        before = staying.radiance(data, "eye", *SIZE)
        leaving.close()
        leaving.close()
        np.testing.assert_array_equal(staying.radiance(data, "eye", *SIZE), before)
    refuses(staying, data)


def refuses(renderer: Renderer, data: mujoco.MjData) -> None:
    with pytest.raises(RendererError, match="is closed"):
        renderer.radiance(data, "eye", *SIZE)


@pytest.mark.quick_cases("filament")
@pytest.mark.parametrize("kind", KINDS)
def test_spawned_workers_draw_what_their_parent_draws(kind: RendererKind) -> None:
    ours = drawn(kind)
    with multiprocessing.get_context("spawn").Pool(2) as workers:
        theirs = workers.map(drawn, [kind, kind])
    for frame in theirs:
        # A byte of an image is a step of about 1 % in the light.
        np.testing.assert_allclose(frame, ours, rtol=0.01, atol=0.01 * ours.max())
