import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.robots import DifferentialDrive, RobotsError, Twist, WheelSpeeds

DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
twists = st.builds(Twist, st.floats(-5, 5), st.floats(-20, 20))


def test_straight_and_spin_by_hand() -> None:
    assert DRIVE.wheel_speeds(Twist(0.36, 0.0)) == WheelSpeeds(pytest.approx(3.0), pytest.approx(3.0))
    assert DRIVE.wheel_speeds(Twist(0.0, 1.2)) == WheelSpeeds(pytest.approx(-3.1), pytest.approx(3.1))


@given(st.floats(-0.4, 0.4), st.floats(-1.0, 1.0))
def test_wheels_give_the_twist_back_below_the_limit(linear: float, angular: float) -> None:
    back = DRIVE.twist(DRIVE.wheel_speeds(Twist(linear, angular)))
    assert (back.linear, back.angular) == (pytest.approx(linear, abs=1e-12), pytest.approx(angular, abs=1e-12))


@given(twists)
def test_no_wheel_is_ever_too_fast(twist: Twist) -> None:
    speeds = DRIVE.wheel_speeds(twist)
    assert max(abs(speeds.left), abs(speeds.right)) <= 8.0 * (1 + 1e-12)


@given(twists)
def test_limits_keep_the_curvature_and_the_direction(twist: Twist) -> None:
    limited = DRIVE.limited(twist)
    cross = limited.linear * twist.angular - limited.angular * twist.linear
    assert cross == pytest.approx(0, abs=1e-9)
    assert limited.linear * twist.linear >= 0
    assert limited.angular * twist.angular >= 0


@given(twists)
def test_limiting_twice_changes_nothing(twist: Twist) -> None:
    once = DRIVE.limited(twist)
    twice = DRIVE.limited(once)
    assert (twice.linear, twice.angular) == (pytest.approx(once.linear), pytest.approx(once.angular))


def test_the_fastest_straight_drive_uses_the_wheels_fully() -> None:
    assert DRIVE.limited(Twist(100.0, 0.0)).linear == pytest.approx(0.96)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_twist_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(RobotsError, match=r"cannot be driven: both values must be finite$"):
        Twist(value, 0.0)


def test_a_wheel_without_radius_is_refused() -> None:
    with pytest.raises(RobotsError) as error:
        DifferentialDrive(track=0.62, wheel_radius=0.0, max_wheel_speed=8.0)
    assert str(error.value) == "differential drive: wheel_radius = 0.0 must be positive and finite"
