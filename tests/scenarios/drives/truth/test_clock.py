"""Clock of a truth against odometry: found by corners and speed, and not told where nothing shows it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.logs.recording import TimedData, views_of
from refseq.logs.trajectory import Trajectory
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.drives.truth.clock import truth_clock

SPEED = 0.5


def way(seconds: int = 200) -> Trajectory:
    """A robot at 0.5 m/s, ten times a second, that turns left and right at corners 12 to 20 s apart."""
    rng = np.random.default_rng(4)
    corners = np.cumsum(rng.uniform(12.0, 20.0, 30))
    times = np.arange(0.0, seconds, 0.1)
    turned = np.clip(times[:, np.newaxis] - corners, 0, 2) / 2 * np.pi / 2 * rng.choice([-1, 1], 30)
    heading = turned.sum(axis=1)
    steps = 0.1 * SPEED * np.column_stack([np.cos(heading), np.sin(heading)])
    return Trajectory(times, np.column_stack([np.cumsum(steps, axis=0), heading]))


def drive(true: Trajectory, late: float = 0.0, noise: float = 0.0, scale: float = 1.0) -> list[View]:
    """Views once a second; the truth is noisy [m], and its stamps are late [s]."""
    rng, times = np.random.default_rng(1), np.arange(15.0, true.times[-1] - 15.0)
    views = list(views_of(TimedData(time, odometry=Pose(*row)) for time, row in _rows(true, times)))
    shown = [Pose(x + rng.normal(0, noise), y + rng.normal(0, noise), a) for _, (x, y, a) in _rows(true, times - late)]
    return [replace(one, distance=scale * one.distance, truth=pose) for one, pose in zip(views, shown, strict=True)]


def _rows(true: Trajectory, times: NDArray[np.float64]) -> Sequence[tuple[float, list[float]]]:
    return list(zip(times.tolist(), true.at(times).tolist(), strict=True))


@given(st.floats(-9.0, 9.0).filter(lambda late: abs(late) > 1.0), st.floats(0.92, 1.08))
def test_a_delay_is_found_whatever_the_scale(late: float, scale: float) -> None:
    found = truth_clock(drive(way(), late, noise=0.03, scale=scale))
    assert found is not None
    assert found.late == pytest.approx(late, abs=0.25)
    assert found.error < 0.2


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_clock_that_is_right_or_nearly_so_is_not_told(late: float) -> None:
    assert truth_clock(drive(way(), late, noise=0.03)) is None


def test_a_robot_that_goes_straight_on_tells_no_clock() -> None:
    times = np.arange(0.0, 200.0, 0.1)
    straight = Trajectory(times, np.column_stack([SPEED * times, 0 * times, 0 * times]))
    assert truth_clock(drive(straight, 3.0, noise=0.03)) is None


def test_a_few_metres_and_none_tell_nothing() -> None:
    views = drive(way(), 3.0)
    assert truth_clock(views[:15]) is None
    assert truth_clock([]) is None
    assert truth_clock([replace(view, truth=None) for view in views]) is None
    assert truth_clock([replace(view, distance=0.0, turn=0.0) for view in views]) is None
