import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.view import LASER, Pose, Scan, View, motion_between, wrap

quick = settings(deadline=None, max_examples=100, derandomize=True)
coordinates = st.floats(-50, 50)
angles = st.floats(-math.pi, math.pi)


@quick
@given(st.floats(-100, 100))
def test_wrap_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi - 1e-12 < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "expected"), [(math.pi, math.pi), (-math.pi, math.pi), (0.0, 0.0), (7.0, 7 - math.tau)]
)
def test_wrap_keeps_the_upper_end(angle: float, expected: float) -> None:
    assert wrap(angle) == pytest.approx(expected, abs=1e-12)


@quick
@given(coordinates, coordinates, angles, st.floats(-3, 3), st.floats(0.5, 20), st.booleans())
def test_motion_between_inverts_an_arc(
    x: float, y: float, heading: float, turn: float, radius: float, back: bool
) -> None:
    """On an arc the chord is 2 r sin(turn / 2), and a robot that backs along it has gone a negative distance."""
    sign = -1.0 if back else 1.0
    side = math.copysign(1.0, turn) * sign
    centre = x - side * radius * math.sin(heading), y + side * radius * math.cos(heading)
    after = Pose(
        centre[0] + side * radius * math.sin(heading + turn),
        centre[1] - side * radius * math.cos(heading + turn),
        heading + turn,
    )
    chord = 2 * radius * abs(math.sin(turn / 2))
    distance, turned = motion_between(Pose(x, y, heading), after)
    if chord > 1e-6:
        assert distance == pytest.approx(sign * chord, abs=1e-9)
    assert turned == pytest.approx(turn, abs=1e-9)


@quick
@given(coordinates, coordinates, angles, st.floats(-5, 5).filter(lambda d: abs(d) > 1e-3), st.floats(-2, 2))
def test_going_there_and_back_cancel(x: float, y: float, heading: float, distance: float, turn: float) -> None:
    along = heading + turn / 2
    before = Pose(x, y, heading)
    after = Pose(x + distance * math.cos(along), y + distance * math.sin(along), heading + turn)
    there, back = motion_between(before, after), motion_between(after, before)
    assert there == pytest.approx((distance, turn), abs=1e-9)
    assert back == pytest.approx((-distance, -turn), abs=1e-9)


def test_turn_crosses_the_half_turn_the_short_way() -> None:
    assert motion_between(Pose(0, 0, 3.1), Pose(0, 0, -3.1))[1] == pytest.approx(math.tau - 6.2)


def test_bearings_and_points_of_a_scan() -> None:
    scan = Scan(np.array([1, 2, np.inf, 3, 4], np.float32), -math.pi / 2, math.pi / 4, max_range=10.0)
    assert scan.bearings == pytest.approx(np.radians([-90, -45, 0, 45, 90]))
    half = math.sqrt(0.5)
    expected = np.array([[0, -1], [2 * half, -2 * half], [10, 0], [3 * half, 3 * half], [0, 4]])
    assert scan.points == pytest.approx(expected, abs=1e-12)


def test_a_scan_by_default_covers_the_half_turn_in_front() -> None:
    bearings = Scan(np.ones(361, np.float32)).bearings
    assert (bearings[0], bearings[180], bearings[-1]) == pytest.approx((-math.pi / 2, 0.0, math.pi / 2), abs=1e-12)


def test_sensors_are_the_cameras_and_the_laser_that_are_there() -> None:
    image, scan = np.zeros((2, 2), np.uint8), Scan(np.ones(3, np.float32))
    assert View(0.0).sensors == frozenset()
    assert View(0.0, {"camera-1": image}).sensors == {"camera-1"}
    assert View(0.0, {"camera-1": image}, scan).sensors == {"camera-1", LASER}
