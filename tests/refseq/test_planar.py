import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.planar import Pose, in_world, motion_between, relative_pose, wrap

quick = settings(derandomize=True)
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


@quick
@given(*(st.floats(-3, 3) for _ in range(6)))
def test_a_relative_pose_undoes_a_motion(x: float, y: float, h: float, dx: float, dy: float, turn: float) -> None:
    moved = Pose(x + dx * math.cos(h) - dy * math.sin(h), y + dx * math.sin(h) + dy * math.cos(h), h + turn)
    seen = relative_pose(moved, Pose(x, y, h))
    assert (seen.x, seen.y, seen.heading) == pytest.approx((dx, dy, turn), abs=1e-9)
    assert in_world((dx, dy), Pose(x, y, h)) == pytest.approx((moved.x, moved.y), abs=1e-9)


def test_points_of_any_shape_turn_and_move_with_their_frame() -> None:
    points = np.arange(12.0).reshape(2, 3, 2)
    assert in_world(points, Pose(1, 2, math.pi / 2)) == pytest.approx(points[..., ::-1] * (-1, 1) + (1, 2), abs=1e-12)
