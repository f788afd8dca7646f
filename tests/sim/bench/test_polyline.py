"""Polylines against plain geometry."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq_bench.sim.bench.polyline import REACH, Polyline
from refseq_bench.sim.errors import SimError

BENT = Polyline(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 3.0]]))
THERE_AND_BACK = Polyline(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]]))


def test_a_way_is_as_long_as_its_legs_and_a_point_twice_is_one() -> None:
    assert BENT.length == 7.0
    assert BENT.along.tolist() == [0.0, 4.0, 7.0]


@pytest.mark.parametrize("along", [0.0, 1.3, 3.9, 4.5, 7.0])
@pytest.mark.parametrize("aside", [-0.3, 0.0, 0.2])
def test_a_pose_beside_the_way_is_found_where_it_was_put(along: float, aside: float) -> None:
    found, off = BENT.project(BENT.pose(along, aside))
    # Inside of the bend the other leg is nearer.
    if not (along == 3.9 and aside == 0.2):
        assert (found, off) == (pytest.approx(along), pytest.approx(abs(aside)))


def test_a_pose_looks_along_the_way_and_turns_to_its_left() -> None:
    assert BENT.pose(1.0) == Pose(1.0, 0.0, 0.0)
    up = BENT.pose(5.0, aside=0.5, turned=0.1)
    assert (up.x, up.y, up.heading) == pytest.approx((3.5, 1.0, math.pi / 2 + 0.1))


def test_no_point_of_the_way_is_nearer_than_the_one_that_is_found() -> None:
    rng = np.random.default_rng(0)
    fine = np.array([(pose.x, pose.y) for pose in map(BENT.pose, np.linspace(0, 7, 7001))])
    for x, y in rng.uniform(-2, 6, (50, 2)):
        along, off = BENT.project(Pose(x, y, 0.0))
        gaps = np.hypot(*(fine - (x, y)).T)
        assert off == pytest.approx(gaps.min(), abs=1e-3)
        assert math.dist((x, y), (BENT.pose(along).x, BENT.pose(along).y)) == pytest.approx(off)


def test_where_a_way_passes_twice_it_is_found_near_where_it_was() -> None:
    between = Pose(3.0, 0.6, 0.0)
    assert THERE_AND_BACK.project(between)[0] == pytest.approx(18.0)
    assert THERE_AND_BACK.project(between, near=2.5) == (pytest.approx(3.0), pytest.approx(0.6))
    assert THERE_AND_BACK.project(between, near=8.0)[0] == pytest.approx(8.0 - REACH)


@given(
    corners=st.lists(st.tuples(st.integers(-5, 5), st.integers(-5, 5)), min_size=2, max_size=8),
    x=st.floats(-6, 6),
    y=st.floats(-6, 6),
    near=st.floats(0, 1),
    reach=st.floats(0.1, 4),
)
def test_within_reach_no_point_is_nearer(
    corners: list[tuple[int, int]], x: float, y: float, near: float, reach: float
) -> None:
    assume(len(set(corners)) > 1)
    line = Polyline(np.array(corners, float))
    middle = near * line.length
    along, off = line.project(Pose(x, y, 0.0), middle, reach)
    low, high = max(middle - reach, 0.0), min(middle + reach, line.length)
    assert low <= along <= high
    found = line.pose(along)
    assert math.dist((x, y), (found.x, found.y)) == pytest.approx(off, abs=1e-9)
    others = map(line.pose, np.linspace(low, high, 200).tolist())
    assert off <= min(math.dist((x, y), (pose.x, pose.y)) for pose in others) + 1e-9


def test_off_its_length_the_nearest_end_is_looked_at() -> None:
    assert BENT.project(Pose(0.0, 0.0, 0.0), near=20.0) == (7.0, 5.0)
    assert BENT.project(Pose(3.0, 0.0, 0.0), near=-5.0) == (0.0, 3.0)


def test_beyond_its_ends_it_goes_straight_on() -> None:
    assert BENT.pose(-1.0) == Pose(-1.0, 0.0, 0.0)
    assert BENT.pose(8.0) == Pose(4.0, 4.0, math.pi / 2)


@pytest.mark.parametrize("points", [[[0.0, 0.0]], [[1.0, 1.0], [1.0, 1.0]], [[0.0, math.nan], [1.0, 0.0]], [0.0, 1.0]])
def test_points_that_make_no_polyline_are_refused(points: object) -> None:
    with pytest.raises(SimError, match="a route"):
        Polyline(np.array(points))
