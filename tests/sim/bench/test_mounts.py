"""Sensors of an individual robot are where its errors put them."""

import math

import numpy as np
import pytest

from refseq_bench import robots
from refseq_bench.robots.individual import AS_BUILT, spread_named
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.sensor_rig import sensor_rig
from refseq_bench.sim.rendering.renderer import RendererKind


def robuter(**more: object) -> Bench:
    return Bench(empty_floor(), robots.load("robuter"), settings=BenchSettings(RendererKind.NONE, **more))


def test_cameras_and_laser_are_raised_and_turned_by_the_individuals_errors() -> None:
    with robuter() as drawn, robuter(spread=spread_named(AS_BUILT), unit=0) as built:
        robot, cameras = built.individual, ("camera-1", "camera-2")
        assert {error.raised for error in drawn.individual.cameras.values()} == {0.0}
        for name in cameras:
            plain, moved = (bench.data.camera(f"robuter/{name}") for bench in (drawn, built))
            error = robot.cameras[name]
            assert moved.xpos[2] - plain.xpos[2] == pytest.approx(error.raised, abs=1e-6)
            right, up, back = (plain.xmat.reshape(3, 3)[:, axis] for axis in range(3))
            looks = -moved.xmat.reshape(3, 3)[:, 2]
            # Turns of a degree or two add up as a vector, to within their squares.
            assert math.asin(looks @ up) == pytest.approx(error.tilt, abs=1.5e-3)
            assert math.asin(looks @ -right) == pytest.approx(error.pan, abs=1.5e-3)
            assert math.asin(moved.xmat.reshape(3, 3)[:, 1] @ right) == pytest.approx(error.roll, abs=1.5e-3)
            assert looks @ back < -0.99
            focal = [bench.camera_models[name].lens.focal for bench in (drawn, built)]
            assert focal[1] / focal[0] - 1 == pytest.approx(error.focal)
        plain, moved = (bench.data.site("robuter/laser") for bench in (drawn, built))
        ahead, left, up = (plain.xmat.reshape(3, 3)[:, axis] for axis in range(3))
        beam = moved.xmat.reshape(3, 3)[:, 0]
        assert math.asin(beam @ left) == pytest.approx(robot.laser.pan, abs=1.5e-3)
        assert math.asin(beam @ up) == pytest.approx(robot.laser.tilt, abs=1.5e-3)
        assert np.asarray(beam @ ahead) > 0.99
        # Clockwise as seen from behind: the left side comes up.
        assert math.asin(moved.xmat.reshape(3, 3)[:, 1] @ up) == pytest.approx(robot.laser.roll, abs=1.5e-3)
        assert moved.xpos[2] - plain.xpos[2] == pytest.approx(robot.laser.raised, abs=1e-6)


def test_a_bench_made_again_of_its_settings_has_the_same_cameras() -> None:
    with robuter(spread=spread_named(AS_BUILT), unit=3) as one:
        with Bench(empty_floor(), robots.load("robuter"), settings=one.settings) as again:
            assert again.settings == one.settings
            assert again.camera_models == one.camera_models
            assert np.array_equal(again.model.cam_fovy, one.model.cam_fovy)
        assert sensor_rig(one).calibrations["camera-1"].matrix[0] == one.camera_models["camera-1"].optics().focal
