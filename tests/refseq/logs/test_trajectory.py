import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from refseq.logs.trajectory import Trajectory
from refseq.planar import Pose

headings = st.lists(st.floats(-20, 20), min_size=2, max_size=12)


@given(headings, st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_headings_are_interpolated_as_by_slerp(turned: list[float], shares: list[float]) -> None:
    times = np.arange(len(turned), dtype=float)
    steps = np.diff(turned)
    if (np.abs(np.abs(np.remainder(steps + math.pi, 2 * math.pi) - math.pi) - math.pi) < 1e-3).any():
        return  # half a turn: neither way is the short one
    way = Trajectory.of(times, [Pose(2 * t, -t, heading) for t, heading in enumerate(turned)])
    wanted = np.array(shares) * times[-1]
    oracle = Slerp(times, Rotation.from_rotvec(np.outer(turned, [0, 0, 1])))(wanted)
    found = way.at(wanted)
    error = oracle.inv() * Rotation.from_rotvec(np.outer(found[:, 2], [0, 0, 1]))
    assert error.magnitude() == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(found[:, :2], np.column_stack([2 * wanted, -wanted]), atol=1e-9)


def test_its_own_times_give_its_own_poses_to_the_last_bit() -> None:
    rng = np.random.default_rng(2)
    times = np.sort(1.7e9 + rng.uniform(0, 60, 500))
    way = Trajectory(times, rng.normal(0, 30, (500, 3)))
    np.testing.assert_array_equal(way.at(times), way.poses)


def test_beyond_its_ends_the_last_pose_stands_for_a_little_while() -> None:
    way = Trajectory.of([10.0, 11.0], [Pose(0, 0, 0), Pose(1, 0, 0)])
    found = way.at([9.7, 9.95, 11.05, 11.3], reach=0.1)
    assert np.isnan(found[[0, 3]]).all()
    np.testing.assert_array_equal(found[[1, 2], 0], [0.0, 1.0])


def test_a_gap_is_not_bridged() -> None:
    times = np.concatenate([np.arange(0, 5, 0.05), np.arange(9, 12, 0.05)])
    way = Trajectory.of(times, [Pose(time, 0, 0) for time in times])
    found = way.at([4.9, 5.0, 7.0, 9.5], reach=0.1)
    assert np.isnan(found[:, 0]).tolist() == [False, False, True, False]


@given(st.floats(0, 14), st.floats(0, 3))
def test_in_a_gap_the_nearest_pose_stands(wanted: float, reach: float) -> None:
    """A pose every half second, but for the gap from 4 to 10 s and the end at 11 s."""
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 10.0, 10.5, 11.0])
    way = Trajectory.of(times, [Pose(3 * time, -time, 0) for time in times])
    found = way.at([wanted], reach)[0]
    away = np.abs(times - wanted)
    if 4 < wanted < 10 or wanted > 11:
        nearest = 3 * times[np.flatnonzero(away == away.min())]
        assert np.isnan(found[0]) if away.min() > reach else found[0] in nearest
    else:
        assert found[:2] == pytest.approx((3 * wanted, -wanted))


def test_poses_that_are_always_seconds_apart_leave_no_gap() -> None:
    """A gap is ten times the usual step and more."""
    times = np.array([0.0, 2.0, 4.0, 6.0, 25.0, 27.0, 48.0])
    way = Trajectory.of(times, [Pose(time, 0, 0) for time in times])
    found = way.at([1.0, 3.0, 15.0, 37.0], reach=0.1)[:, 0]
    assert found[:3].tolist() == [1.0, 3.0, 15.0]
    assert np.isnan(found[3])


def test_poses_out_of_order_are_sorted_and_of_one_stamp_the_last_counts() -> None:
    way = Trajectory.of([3.0, 1.0, 2.0, 1.0], [Pose(3, 0, 0), Pose(0, 0, 0), Pose(2, 0, 0), Pose(1, 0, 0)])
    assert way.times.tolist() == way.poses[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert way.length == 2.0


def test_no_pose_says_nothing() -> None:
    assert np.isnan(Trajectory.of([], []).at([1.0], reach=5)).all()
