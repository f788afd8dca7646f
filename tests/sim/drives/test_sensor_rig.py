import math

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.drives.behaviour_runner import description_of
from refseq_bench.sim.drives.sensor_rig import sensor_rig
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

ROUTE = np.array([[1.0, 0.0], [2.0, 1.0]])
"""Begins at 45°, so that the world's axes are not the robot's."""


@pytest.mark.parametrize("name", ["robuter", "segway_rmp"])
def test_mounts_are_in_the_robots_frame(name: str) -> None:
    world = build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), pictured=False)
    robot = robots.load(name)
    settings = BenchSettings(renderer=RendererKind.NONE, cameras=robot.cameras)
    with Bench(world, robot, route=ROUTE, settings=settings) as bench:
        rig = sensor_rig(bench)
    laser = rig.mounts["laser"]
    assert laser.translation[:2] == pytest.approx((description_of(robot).laser.ahead, 0.0), abs=0.02)
    assert 0.1 < laser.translation[2] < 1.0
    np.testing.assert_allclose(Rotation.from_quat(laser.rotation).as_matrix(), np.eye(3), atol=0.02)
    for camera, looks in (("camera-1", (1, 0, 0)), ("camera-2", (0, 1, 0))):
        axes = Rotation.from_quat(rig.mounts[camera].rotation).as_matrix()
        np.testing.assert_allclose(axes[:, 2], looks, atol=0.02)  # along the optical axis
        np.testing.assert_allclose(axes[:, 1], (0, 0, -1), atol=0.02)  # down in the picture


@pytest.mark.parametrize("model", ["fire-i", "fire-i-wide"])
def test_a_calibration_projects_as_the_camera_draws(model: str) -> None:
    """OpenCV's projection with the calibration is where our lens draws a ray."""
    world = build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), pictured=False)
    robot = robots.load("robuter")
    settings = BenchSettings(
        renderer=RendererKind.NONE, cameras=("camera-1",), camera_models={"camera-1": load_camera(model)}
    )
    with Bench(world, robot, route=ROUTE, settings=settings) as bench:
        calibration = sensor_rig(bench).calibrations["camera-1"]
    half = math.radians(15)
    x, y = (side.ravel() for side in np.meshgrid(np.linspace(-half, half, 7), np.linspace(-half, half, 5)))
    drawn = np.stack(load_camera(model).optics().pixels(x, y), axis=-1)
    points = np.stack([x, y, np.ones_like(x)], axis=-1)
    matrix = np.array(calibration.matrix).reshape(3, 3)
    projected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(calibration.distortion))
    np.testing.assert_allclose(projected.reshape(-1, 2), drawn, atol=1e-6)
    assert (calibration.width, calibration.height) == (640, 480)
