"""The drive that others' bags are made of is what it says, so that a reader can be checked against it."""

import math
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin

from refseq.planar import Pose, motion_between
from tests.refseq.logs.foreign import RosSetup, write_rosbag1, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive, Sense

DRIVE = RobotDrive(seconds=3.0, gap=(0.95, 1.95))


def test_odometer_and_truth_move_alike() -> None:
    times = DRIVE.start + np.linspace(0, DRIVE.seconds, 7)
    for before, after in pairwise(times.tolist()):
        true = motion_between(DRIVE.pose(before), DRIVE.pose(after))
        assert motion_between(DRIVE.odometry(before), DRIVE.odometry(after)) == pytest.approx(true, abs=1e-9)


def test_sensors_are_asynchronous() -> None:
    times: dict[Sense, list[float]] = {sense: [] for sense in Sense}
    for moment in DRIVE.moments:
        times[moment.sense].append(moment.time)
        assert 0 <= moment.logged - moment.time < 0.005
    assert [len(times[sense]) for sense in Sense] == [20, 30, 60, 15]
    assert not set(times[Sense.PICTURE]) & set(times[Sense.SCAN])
    assert max(np.diff(sorted(times[Sense.PICTURE]))) == pytest.approx(1.1, abs=0.02)


def test_a_laser_that_is_mounted_otherwise_sees_the_same_walls() -> None:
    bearings = np.radians(np.arange(-40.0, 41.0))
    ahead = DRIVE.ranges(DRIVE.start, bearings)
    turned = DRIVE.ranges(DRIVE.start, bearings - 2.0, Pose(0.0, 0.0, 2.0))
    np.testing.assert_allclose(turned, ahead, rtol=1e-6)
    moved = DRIVE.ranges(DRIVE.start, np.zeros(1), Pose(0.5, 0.0, 0.0))
    assert ahead[40] - moved[0] == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3, None])
def test_bags_hold_what_was_sensed(tmp_path: Path, storage: StoragePlugin | None) -> None:
    setup = RosSetup(laser=Pose(0.2, 0.1, math.pi), upside_down=True)
    if storage is None:
        path = write_rosbag1(tmp_path / "drive.bag", DRIVE, setup)
    else:
        path = write_rosbag2(tmp_path / "drive", DRIVE, setup, storage)
    counts: Counter[str] = Counter()
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            counts[connection.topic] += 1
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/ground_truth":
                pose = DRIVE.pose(message.header.stamp.sec + message.header.stamp.nanosec / 1e9)
                assert (message.pose.position.x, message.pose.position.y) == pytest.approx((pose.x, pose.y), abs=1e-5)
    assert counts == {
        "/tf_static": 1,
        "/camera/image_raw/compressed": 20,
        "/scan": 30,
        "/odom": 60,
        "/ground_truth": 15,
    }
