import math

import gymnasium as gym
import numpy as np
import pytest

import refseq_bench.sim.envs
from refseq_bench.sim.cameras.camera import Camera, CameraModel
from refseq_bench.sim.envs.episodes.pixels import square_camera
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import gl_backend

ID = "refseq/FollowCorridorTwist-v0"


@pytest.mark.parametrize("side", [16, 84, 480])
def test_the_middle_of_what_the_camera_sees(side: int) -> None:
    """As high as the camera's own image: the same angle upwards, and the same one to the sides."""
    sensor, whole = square_camera(CameraModel(), side).sensor, CameraModel().sensor
    assert sensor.size == (side, side)
    assert sensor.pixel * side == pytest.approx(whole.pixel * whole.size[1])


def test_an_evenly_lit_wall_is_as_bright_as_by_the_camera_itself() -> None:
    """And quieter: a pixel's light is that of 33 of the camera's."""
    found = {}
    for side, model in ((None, CameraModel()), (84, square_camera(CameraModel(), 84))):
        width, height = model.sensor.size
        camera, wall = Camera(model, np.random.default_rng(0)), np.full((height, width), 40.0, np.float32)
        high, wide = slice(height // 3, -height // 3), slice(width // 2 - height // 6, width // 2 + height // 6)
        first, second = (camera.digital(wall)[high, wide].astype(float) for _ in range(2))
        found[side] = float(first.mean()), float((second - first).std() / first.mean())
    # Darker corners, which the square has less of, count for the exposure.
    assert found[84][0] == pytest.approx(found[None][0], rel=0.04)
    assert found[84][1] < 0.25 * found[None][1]


@pytest.mark.parametrize("side", [15, 481, 84.0, True, "84"])
def test_sides_that_no_image_has(side: object) -> None:
    with pytest.raises(SimError) as caught:
        gym.make(ID, cameras=["camera-1"], pixels=side)
    assert str(caught.value) == f"pixels = {side!r} is not valid: valid is a whole number from 16 to 480"


@pytest.mark.skipif(gl_backend() is None, reason="OpenGL does not start")
def test_episodes_with_small_images_repeat() -> None:
    assert ID in refseq_bench.sim.envs.IDS
    seen = []
    for _ in range(2):
        with gym.make(ID, world="corridor:3", cameras=["camera-1"], renderer="classic", pixels=24) as env:
            env.reset(seed=4)
            seen.append(env.step(np.array([0.4, 0.0], np.float32))[0])
            assert env.observation_space.contains(seen[-1])
    first, second = seen
    assert first["camera-1"].shape == (24, 24)
    assert first["camera-1"].std() > 5
    assert math.isfinite(float(first["scan"].sum()))
    np.testing.assert_array_equal(first["scan"], second["scan"])
    assert np.abs(first["camera-1"].astype(int) - second["camera-1"]).max() <= 1
