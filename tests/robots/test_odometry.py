import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.robots import DifferentialDrive, PlanarPose, RobotsError, Twist
from refseq_bench.robots.odometry import (
    CalibrationErrors,
    Encoders,
    Geometry,
    Odometry,
    Pulses,
    along_arc,
    believed_geometry,
    true_geometry,
)
from tests.robots.driving import PREFIX, Driven, ramped

DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
FINE = Encoders(10**11)
ROBUTER = Encoders(8024)
PERFECT = true_geometry(DRIVE)


def rolled(geometry: Geometry, encoders: Encoders, left: np.ndarray, right: np.ndarray) -> Odometry:
    """Odometry after the wheels went through these angles [rad]."""
    odometry = Odometry(geometry, encoders)
    for a, b in zip(left, right, strict=True):
        odometry.update(encoders.read(a, b))
    return odometry


def test_a_turn_makes_as_many_pulses_as_the_encoder_has() -> None:
    assert ROBUTER.read(2 * math.pi + 1e-9, -2 * math.pi + 1e-9) == Pulses(8024, -8024)


@given(st.floats(-1e4, 1e4))
def test_a_reading_is_never_more_than_a_pulse_behind(angle: float) -> None:
    behind = angle - ROBUTER.angle(ROBUTER.read(angle, 0.0).left)
    assert -1e-9 <= behind <= 2 * math.pi / 8024 + 1e-9


def test_a_pulse_is_94_micrometres() -> None:
    assert ROBUTER.angle(1) * 0.12 == pytest.approx(94.0e-6, abs=0.05e-6)


@given(st.floats(-2, 2), st.floats(-3, 3), st.integers(1, 40))
def test_wheels_that_do_not_slip_are_integrated_exactly(linear: float, angular: float, samples: int) -> None:
    speeds = np.array([linear - angular * 0.31, linear + angular * 0.31]) / 0.12
    times = np.linspace(0, 5, samples + 1)[1:]
    odometry = rolled(PERFECT, FINE, speeds[0] * times, speeds[1] * times)
    turn = 5 * angular
    x = linear / angular * math.sin(turn) if abs(angular) > 1e-6 else 5 * linear
    y = linear / angular * (1 - math.cos(turn)) if abs(angular) > 1e-6 else 12.5 * linear * angular
    assert (odometry.pose.x, odometry.pose.y) == (pytest.approx(x, abs=1e-6), pytest.approx(y, abs=1e-6))
    assert odometry.pose.heading == pytest.approx(turn, abs=1e-7)
    assert odometry.distance == pytest.approx(5 * linear, abs=1e-7)


def test_arcs_compose() -> None:
    whole = along_arc(PlanarPose(1, 2, 0.3), 4.0, 2.0)
    half = along_arc(along_arc(PlanarPose(1, 2, 0.3), 2.0, 1.0), 2.0, 1.0)
    assert (half.x, half.y, half.heading) == pytest.approx((whole.x, whole.y, whole.heading))


def test_pulses_lost_between_updates_are_not_lost_for_good() -> None:
    angles = np.linspace(0, 100, 10_001)
    odometry = rolled(PERFECT, ROBUTER, angles, angles)
    assert odometry.pose.x == pytest.approx(12.0, abs=1e-4)


def test_it_starts_where_the_counters_stand() -> None:
    start = Pulses(123_456, -777)
    odometry = Odometry(PERFECT, ROBUTER, start)
    assert odometry.update(start) == PlanarPose(0, 0, 0)


def test_reversing_counts_negative() -> None:
    odometry = rolled(PERFECT, FINE, np.array([-5.0]), np.array([-5.0]))
    assert odometry.distance == pytest.approx(-0.6)


def test_a_wrong_belief_shows_as_theory_says() -> None:
    angle = np.array([20 / 0.12])
    longer = rolled(Geometry(0.1212, 0.1212, 0.62), FINE, angle, angle)
    assert longer.pose.x == pytest.approx(20.2)
    bent = rolled(Geometry(0.12 * 0.9995, 0.12 * 1.0005, 0.62), FINE, angle, angle)
    assert bent.pose.heading == pytest.approx(20 * 0.001 / 0.62)
    narrow = rolled(Geometry(0.12, 0.12, 0.62 * 1.01), FINE, -angle, angle)
    assert narrow.pose.heading == pytest.approx(40 / 0.62 / 1.01)


def test_beliefs_spread_as_asked() -> None:
    rng = np.random.default_rng(0)
    drawn = [believed_geometry(DRIVE, CalibrationErrors(), rng) for _ in range(4000)]
    left, right, track = np.array([(g.left_radius, g.right_radius, g.track) for g in drawn]).T
    assert np.std((left + right) / 0.24) == pytest.approx(0.003, rel=0.05)
    assert np.std((right - left) / 0.12) == pytest.approx(0.0006, rel=0.05)
    assert np.std(track / 0.62) == pytest.approx(0.003, rel=0.05)
    assert np.mean(track) == pytest.approx(0.62, rel=3e-4)


def test_a_mismatch_is_the_right_wheels_excess_over_the_left_one() -> None:
    drawn = SimpleNamespace(normal=lambda mean, sigma, count: np.ones(count))
    believed = believed_geometry(DRIVE, CalibrationErrors(0.0, 0.002, 0.01), cast("np.random.Generator", drawn))
    assert believed.right_radius / believed.left_radius == pytest.approx(1.002, abs=1e-5)
    assert (believed.left_radius + believed.right_radius) / 2 == pytest.approx(0.12)
    assert believed.track == pytest.approx(0.62 * 1.01)


def test_without_errors_a_robot_believes_the_truth() -> None:
    assert believed_geometry(DRIVE, CalibrationErrors(0, 0, 0), np.random.default_rng(0)) == PERFECT


def test_beliefs_repeat_by_seed() -> None:
    first, again, other = (
        believed_geometry(DRIVE, CalibrationErrors(), np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert first == again != other


@pytest.fixture(scope="module")
def driven_slalom() -> tuple[Driven, list[tuple[float, float]]]:
    """A robot that went 10 m in bends, and its wheel angles on the way."""
    driven, angles = Driven(), []
    bends = ramped(Twist(0.5, 0.0), 21.0)
    driven.drive(
        22.0,
        lambda t: Twist(bends(t).linear, 0.3 * bends(t).linear * math.sin(t)),
        lambda: angles.append(driven.wheel_angles),
    )
    return driven, angles


def test_a_driven_path_within_the_slip(driven_slalom: tuple[Driven, list[tuple[float, float]]]) -> None:
    driven, angles = driven_slalom
    pose = rolled(true_geometry(driven.robot.drive), ROBUTER, *np.array(angles).T).pose
    gap = math.hypot(pose.x - driven.pose.x, pose.y - driven.pose.y)
    assert 1e-4 < gap < 0.1  # it slips, by less than a hundredth of the way
    assert abs(pose.heading - driven.turned) < math.radians(1)


@pytest.mark.parametrize("seed", range(5))
def test_a_driven_path_within_the_calibration(
    driven_slalom: tuple[Driven, list[tuple[float, float]]], seed: int
) -> None:
    driven, angles = driven_slalom
    believed = believed_geometry(driven.robot.drive, CalibrationErrors(), np.random.default_rng(seed))
    pose = rolled(believed, ROBUTER, *np.array(angles).T).pose
    gap = math.hypot(pose.x - driven.pose.x, pose.y - driven.pose.y)
    # Three deviations each: 10 m too long or short, and a heading that runs away with the mismatch.
    assert gap < 3 * (10 * 0.003 + 0.5 * 10**2 * 0.0006 / 0.62) + 0.1


def test_a_robot_is_not_told_the_truth(driven_slalom: tuple[Driven, list[tuple[float, float]]]) -> None:
    driven, angles = driven_slalom
    twice = rolled(Geometry(0.24, 0.24, 1.24), ROBUTER, *np.array(angles).T)
    assert twice.distance == pytest.approx(2 * rolled(PERFECT, ROBUTER, *np.array(angles).T).distance)
    assert twice.pose.x > 1.5 * driven.pose.x


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Encoders(0), "encoders: pulses_per_turn = 0: at least 1 is needed"),
        (lambda: CalibrationErrors(track=0.5), "calibration: track = 0.5 must be in [0, 0.1)"),
    ],
)
def test_impossible_figures_are_refused(make: type, message: str) -> None:
    with pytest.raises(RobotsError) as error:
        make()
    assert str(error.value) == message


@given(st.floats(1, 50), st.floats(-0.002, 0.002))
def test_unequal_wheels_bend_what_was_straight_into_an_arc(length: float, mismatch: float) -> None:
    """Slip-free theory: heading grows with the way, what is off to the side with its square."""
    angle = np.array([length / 0.12])
    pose = rolled(Geometry(0.12 * (1 - mismatch / 2), 0.12 * (1 + mismatch / 2), 0.62), FINE, angle, angle).pose
    turn = length * mismatch / 0.62
    assert pose.heading == pytest.approx(turn, rel=1e-5, abs=1e-9)
    aside = length / turn * (1 - math.cos(turn)) if abs(turn) > 1e-4 else length * turn / 2
    assert pose.y == pytest.approx(aside, rel=1e-4, abs=1e-5)
    assert length - pose.x == pytest.approx(length * turn**2 / 6, rel=0.1, abs=1e-5)


@given(st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
def test_a_circle_by_a_wrong_size_or_track_closes_too_late_or_too_early(size: float, track: float) -> None:
    """A true circle of radius 2 m: the odometer turns by (1 + size) / (1 + track) of it, on a radius of its own."""
    inner, outer = (np.array([2 * math.pi * (2.0 + side * 0.31) / 0.12]) for side in (-1, 1))
    believed = Geometry(0.12 * (1 + size), 0.12 * (1 + size), 0.62 * (1 + track))
    odometry = rolled(believed, FINE, inner, outer)
    assert odometry.pose.heading == pytest.approx(2 * math.pi * (1 + size) / (1 + track))
    assert odometry.distance == pytest.approx(2 * math.pi * 2.0 * (1 + size))
    gap = 2 * 2.0 * (1 + track) * abs(math.sin(odometry.pose.heading / 2))
    assert math.hypot(odometry.pose.x, odometry.pose.y) == pytest.approx(gap, abs=1e-6)


def test_the_error_of_a_driven_straight_grows_as_theory_says() -> None:
    """Heading with the distance, to the side with its square; beside it the tyres slip by little."""
    wrong, driven, angles, true = Geometry(0.1199, 0.1201, 0.62), Driven(), [], []

    def look() -> None:
        angles.append(driven.wheel_angles)
        true.append((driven.pose.x, driven.pose.y, driven.pose.heading))

    driven.drive(43.0, ramped(Twist(0.5, 0.0), 41.0), look)
    odometry, told = Odometry(wrong, ROBUTER), []
    for left, right in angles:
        told.append(odometry.update(ROBUTER.read(left, right)))
    truth = np.array(true)
    shown = np.array([(pose.x, pose.y, pose.heading) for pose in told])
    for distance in (5.0, 10.0, 19.5):
        at = int(truth[:, 0].searchsorted(distance))
        bend = distance * (0.1201 - 0.1199) / 0.12 / 0.62
        heading, aside = shown[at, 2] - truth[at, 2], shown[at, 1] - truth[at, 1]
        assert heading == pytest.approx(bend, rel=0.05)
        assert aside == pytest.approx(distance * bend / 2, rel=0.05)


class Slipping:
    """A robot that starts with a jerk, with so much grip under its left wheel, and how far its wheels slipped."""

    def __init__(self, grip: float) -> None:
        driven = Driven()
        tread, angles, places = driven.model.geom(PREFIX + "tread-left").id, [driven.wheel_angles], []
        driven.model.geom_friction[tread, 0] = grip
        sides = [driven.data.body(PREFIX + name) for name in driven.robot.wheel_joints]

        def look() -> None:
            angles.append(driven.wheel_angles)
            places.append([(*side.xpos[:2], driven.pose.heading) for side in sides])

        start = [(*side.xpos[:2], 0.0) for side in sides]
        driven.drive(3.0, lambda t: Twist(0.5, 0.0) if t < 2 else Twist(), look)
        went = np.array([start, *places])  # (moments, wheels, 3)
        steps, middle = np.diff(went[:, :, :2], axis=0), (went[1:, :, 2] + went[:-1, :, 2]) / 2
        forward = (steps[:, :, 0] * np.cos(middle) + steps[:, :, 1] * np.sin(middle)).sum(axis=0)
        self.slip = 0.12 * (np.array(angles[-1]) - angles[0]) - forward
        self.odometry = rolled(PERFECT, ROBUTER, *np.array(angles).T)
        self.heading_error = self.odometry.pose.heading - driven.turned


def test_a_wheel_that_spins_is_counted_and_turns_the_odometer_but_not_the_robot() -> None:
    """What the odometer's heading is off is what its wheels slipped, over the track."""
    gripping, slipping = Slipping(0.8), Slipping(0.02)
    assert np.abs(gripping.slip).max() < 0.005
    assert slipping.slip[0] > 0.05
    assert abs(slipping.slip[1]) < 0.01
    for found in (gripping, slipping):
        left, right = found.slip
        assert found.heading_error == pytest.approx((right - left) / 0.62, abs=2e-3)
    assert slipping.heading_error < -0.05
    assert abs(gripping.heading_error) < 0.003
