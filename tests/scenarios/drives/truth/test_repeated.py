"""Truth against odometry: told twice, told by a sensor beside the robot's middle, and known from elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from refseq.logs.recording import TimedData, views_of
from refseq.planar import Pose, after_motion
from refseq.view import View
from refseq_bench.scenarios.drives.truth.repeated import repeats_odometry


def drive(slip: float = 0.0, ahead: float = 0.0) -> list[View]:
    """A winding way; the odometer turns more than the robot by ``slip``, the truth is of a point ``ahead`` [m]."""
    pose, views = Pose(2.0, 1.0, 0.3), []
    for k in range(40):
        turn = 0.1 * np.sin(k / 5)
        pose = after_motion(pose, 0.5, turn) if k else pose
        seen = Pose(pose.x + ahead * np.cos(pose.heading), pose.y + ahead * np.sin(pose.heading), pose.heading)
        views.append(View(float(k), distance=0.5 if k else 0.0, turn=turn * (1 + slip) if k else 0.0, truth=seen))
    return views


@pytest.mark.parametrize(("slip", "ahead", "repeated"), [(0, 0, True), (0, 0.2, True), (0.01, 0, False)])
def test_truth_is_told_from_odometry_by_its_headings(slip: float, ahead: float, repeated: bool) -> None:
    assert repeats_odometry(drive(slip, ahead)) is repeated


@pytest.mark.parametrize(("scale", "repeated"), [(1.0, True), (1.02, False)])
def test_mapped_poses_that_slip_aside_are_told_however_long_the_way(scale: float, repeated: bool) -> None:
    """A map of scans a metre apart moves each a little aside, which no distance and no turn can tell."""
    rng = np.random.default_rng(0)
    poses = [Pose(float(k), float(y), 0.0) for k, y in enumerate(rng.normal(0.0, 0.2, 400).cumsum())]
    data = (TimedData(float(k), odometry=pose, truth=pose) for k, pose in enumerate(poses))
    views = [replace(view, distance=scale * view.distance) for view in views_of(data)]
    assert repeats_odometry(views) is repeated


def test_truth_that_is_missing_somewhere_is_no_repetition() -> None:
    views = drive()
    assert not repeats_odometry([*views[:-1], replace(views[-1], truth=None)])
    assert not repeats_odometry(views[:1])
