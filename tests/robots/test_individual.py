"""Robots of one make: what is drawn, and what uneven rolling makes of a heading."""

import math
from dataclasses import astuple

import numpy as np
import pytest

from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.individual import AS_BUILT, CALIBRATED, SPREADS, MountError, RobotSpread, built, spread_named
from refseq_bench.robots.motion import DifferentialDrive
from refseq_bench.robots.odometry import believed_geometry
from refseq_bench.robots.rolling import UnevenRolling, WheelAngles

DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
CAMERAS = ("camera-1", "camera-2")


def test_the_calibrated_robot_is_the_one_of_before() -> None:
    """The same wheels from the same number, even rolling, all mounts as drawn."""
    robot = built(DRIVE, CAMERAS, spread_named(CALIBRATED), unit=1)
    assert robot.believed == believed_geometry(DRIVE, SPREADS[CALIBRATED].calibration, np.random.default_rng(1))
    assert (robot.walk, robot.laser, set(robot.cameras.values())) == (0.0, MountError(), {MountError()})


def test_robots_as_built_differ_and_a_number_is_one_of_them() -> None:
    spread = spread_named(AS_BUILT)
    one, again, other = (built(DRIVE, CAMERAS, spread, unit) for unit in (7, 7, 8))
    assert one == again
    assert one.believed != other.believed
    assert one.cameras["camera-1"] != one.cameras["camera-2"]


def test_the_spread_is_that_which_is_declared() -> None:
    spread = spread_named(AS_BUILT)
    robots = [built(DRIVE, CAMERAS, spread, unit) for unit in range(1000)]
    bends = [(r.believed.right_radius / r.believed.left_radius - 1) for r in robots]
    assert np.std(bends) == pytest.approx(spread.calibration.mismatch, rel=0.1)
    for mounts, declared in (
        ([r.cameras["camera-1"] for r in robots], spread.camera),
        ([r.cameras["camera-2"] for r in robots], spread.camera),
        ([r.laser for r in robots], spread.laser),
    ):
        assert np.std([astuple(mount) for mount in mounts], axis=0) == pytest.approx(astuple(declared), rel=0.1)
    walks = np.array([r.walk for r in robots])
    assert len(set(walks)) == len(robots)
    assert (walks.min() >= spread.walk[0], walks.max() <= spread.walk[1]) == (True, True)
    assert np.median(walks) == pytest.approx(math.sqrt(spread.walk[0] * spread.walk[1]), rel=0.1)


def test_uneven_rolling_makes_a_heading_walk_as_declared() -> None:
    """Over 40 m in steps of 5 cm; 300 robots tell a standard deviation to within 4 %."""
    walk, way = 0.03, 40.0
    angles = np.arange(0.0, way, 0.05) / DRIVE.wheel_radius
    ends = []
    for seed in range(300):
        rolling = UnevenRolling(walk, DRIVE, np.random.default_rng(seed))
        left, right = [rolling.seen(angle, angle) for angle in angles][-1]
        ends.append((right - left) * DRIVE.wheel_radius / DRIVE.track)
    assert np.std(ends) == pytest.approx(walk * math.sqrt(way), rel=0.12)
    assert abs(np.mean(ends)) < 3 * walk * math.sqrt(way / 300)


def test_even_rolling_leaves_angles_as_they_are() -> None:
    rolling = UnevenRolling(0.0, DRIVE, np.random.default_rng(0))
    assert rolling.seen(1.25, -3.5) == WheelAngles(1.25, -3.5)


def test_an_angle_that_cannot_be_read_stays_so_and_is_forgotten() -> None:
    rolling = UnevenRolling(0.01, DRIVE, np.random.default_rng(0))
    assert rolling.seen(2.0, 2.0) == WheelAngles(2.0, 2.0)
    assert all(math.isnan(angle) for angle in rolling.seen(math.nan, math.nan))
    assert rolling.seen(2.0, 2.0) == WheelAngles(2.0, 2.0)


def test_what_is_no_spread_is_told() -> None:
    with pytest.raises(RobotsError, match=r"^unknown robot spread 'worn': valid are calibrated, as-built$"):
        spread_named("worn")
    with pytest.raises(RobotsError, match=r"^robot spread: walk = 0.2, 0.1 rad/√m must be rising"):
        RobotSpread(walk=(0.2, 0.1))
    with pytest.raises(RobotsError, match=r"^robot spread: laser.raised = -0.1 must be 0 or more$"):
        RobotSpread(laser=MountError(raised=-0.1))
    for key, bad in (("pan", math.nan), ("raised", math.inf)):
        with pytest.raises(RobotsError, match=rf"^mount: {key} = {bad} must be finite$"):
            MountError(**{key: bad})
    with pytest.raises(RobotsError, match=r"^mount: focal = -1.5 must be above -1$"):
        MountError(focal=-1.5)
