"""Bags as other projects write them, read as views: these agree with the drive that the bags were made from."""

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.typesys import Stores

from refseq.errors import LogError
from refseq.logs import Recording, read_recording
from refseq.logs.ros.bag import RosBag
from refseq.logs.source import Role
from refseq.planar import Pose, motion_between
from tests.refseq.logs.foreign import (
    BagMessage,
    RosMessages,
    RosSetup,
    write_plain_mcap,
    write_ros2_mcap,
    write_rosbag1,
    write_rosbag2,
)
from tests.refseq.logs.robot_drive import RobotDrive

DRIVE = RobotDrive(seconds=4.0)
JITTER = 3 * DRIVE.jitter
"""By how much a time between two stamps may be off [s]."""

Written = Callable[[Path], Path]
SOURCES: dict[str, Written] = {
    "MCAP": lambda folder: write_rosbag2(folder / "bag", DRIVE),
    "MCAP file": lambda folder: next(write_rosbag2(folder / "bag", DRIVE).glob("*.mcap")),
    "SQLite": lambda folder: write_rosbag2(folder / "bag", DRIVE, storage=StoragePlugin.SQLITE3),
    "SQLite file": lambda folder: next(
        write_rosbag2(folder / "bag", DRIVE, storage=StoragePlugin.SQLITE3).glob("*.db3")
    ),
    "MCAP, file packed": lambda folder: write_rosbag2(folder / "bag", DRIVE, compression=CompressionMode.FILE),
    "SQLite, file packed": lambda folder: write_rosbag2(
        folder / "bag", DRIVE, storage=StoragePlugin.SQLITE3, compression=CompressionMode.FILE
    ),
    "SQLite, messages packed": lambda folder: write_rosbag2(
        folder / "bag", DRIVE, storage=StoragePlugin.SQLITE3, compression=CompressionMode.MESSAGE
    ),
    "MCAP, chunks packed": lambda folder: write_rosbag2(folder / "bag", DRIVE, compression=CompressionMode.STORAGE),
    "MCAP by mcap-ros2-support": lambda folder: write_ros2_mcap(folder / "drive.mcap", DRIVE),
    "MCAP without a profile": lambda folder: write_plain_mcap(folder / "a.mcap", DRIVE, None, Stores.ROS2_HUMBLE),
    "ROS 1 in MCAP": lambda folder: write_plain_mcap(folder / "a.mcap", DRIVE, None, Stores.ROS1_NOETIC),
    "ROS 1": lambda folder: write_rosbag1(folder / "drive.bag", DRIVE),
    "ROS 1, bz2": lambda folder: write_rosbag1(
        folder / "drive.bag", DRIVE, compression=Rosbag1Writer.CompressionFormat.BZ2
    ),
    "ROS 1, lz4": lambda folder: write_rosbag1(
        folder / "drive.bag", DRIVE, compression=Rosbag1Writer.CompressionFormat.LZ4
    ),
}


@pytest.mark.parametrize("source", SOURCES)
def test_views_are_those_of_the_drive(tmp_path: Path, source: str) -> None:
    path = SOURCES[source](tmp_path)
    before = sorted(tmp_path.rglob("*"))
    recording = read_recording(path)
    assert sorted(tmp_path.rglob("*")) == before, "nothing is written beside the bag"
    assert recording.complete
    assert recording.skipped == {}
    assert recording.sensors == {"camera", "laser"}
    check(recording, DRIVE)


def check(recording: Recording, drive: RobotDrive) -> None:
    """Compare views with the drive at their times, but for the first and last, where poses are not interpolated."""
    views = recording.views
    assert len(views) == pytest.approx(drive.seconds * drive.camera_rate, abs=2)
    for view in views:
        # A sensor that does not lead is half a period off at most, in which the robot goes 4 cm.
        around = [drive.picture(float(view.time + late)) for late in np.arange(-0.055, 0.055, 0.002)]
        assert any(np.array_equal(view.images["camera"], picture) for picture in around)
        assert view.scan
        expected = drive.ranges(view.time, view.scan.bearings)
        assert float(np.median(np.abs(view.scan.ranges - expected))) < 0.05
    for view in views[3:-5]:
        true = drive.pose(view.time)
        assert view.truth
        found = view.truth.x, view.truth.y, view.truth.heading
        assert found == pytest.approx((true.x, true.y, true.heading), abs=2e-3)
    for one, other in pairwise(views[1:-1]):
        motion = motion_between(drive.odometry(one.time), drive.odometry(other.time))
        assert (other.distance, other.turn) == pytest.approx(motion, abs=drive.speed * JITTER)


def test_a_bag_says_what_it_holds(tmp_path: Path) -> None:
    bag = RosBag(write_rosbag2(tmp_path / "bag", DRIVE))
    assert [(channel.topic, channel.role, channel.count) for channel in bag.channels] == [
        ("/camera/image_raw/compressed", Role.CAMERA, 40),
        ("/ground_truth", Role.TRUTH, 20),
        ("/odom", Role.ODOMETRY, 80),
        ("/scan", Role.LASER, 40),
        ("/tf_static", Role.TRANSFORMS, 1),
    ]
    assert {channel.encoding for channel in bag.channels} == {"cdr"}
    samples = list(bag.samples(["/scan"]))
    assert {sample.topic for sample in samples} == {"/scan"}
    assert [sample.time for sample in bag.samples(["/scan"])] == [sample.time for sample in samples]
    assert {sample.frame for sample in samples} == {"laser"}


@pytest.mark.quick_cases("False-3.141592653589793-False", "False--2.0-True", "True-0.0-False")
@pytest.mark.parametrize("upside_down", [False, True])
@pytest.mark.parametrize("yaw", [0.0, math.pi, -2.0])
@pytest.mark.parametrize("ros1", [False, True])
def test_a_laser_is_turned_by_its_mount(tmp_path: Path, yaw: float, upside_down: bool, ros1: bool) -> None:
    mount = Pose(0.25, -0.1, yaw)
    setup = RosSetup(laser=mount, upside_down=upside_down, image_format=None)
    path = write_rosbag1(tmp_path / "a.bag", DRIVE, setup) if ros1 else write_rosbag2(tmp_path / "bag", DRIVE, setup)
    views = read_recording(path).views
    assert len(views) == 40
    for view in views:
        assert view.scan
        expected = DRIVE.ranges(view.time, view.scan.bearings, Pose(mount.x, mount.y, 0.0))
        np.testing.assert_allclose(view.scan.ranges, expected, atol=1e-3, rtol=0.02)


def test_transforms_tell_odometry_and_truth_where_no_topic_does(tmp_path: Path) -> None:
    setup = RosSetup(odometry="tf", truth="tf")
    recording = read_recording(write_rosbag2(tmp_path / "bag", DRIVE, setup))
    check(recording, DRIVE)


@pytest.mark.parametrize("image_format", ["mono8", "rgb8", "bgr8", "rgba8", "bgra8", "mono16"])
def test_raw_pictures_with_padded_rows(tmp_path: Path, image_format: str) -> None:
    drive = RobotDrive(seconds=1.0)
    setup = RosSetup(image_format=image_format, scans=False)
    views = read_recording(write_rosbag2(tmp_path / "bag", drive, setup)).views
    assert len(views) == 10
    for view in views:
        difference = view.images["camera"].astype(int) - drive.picture(view.time)
        # 16 bits are stretched to the darkest and lightest pixel.
        assert np.abs(difference).max() <= 1 or image_format == "mono16"
        if image_format == "mono16":
            assert np.corrcoef(view.images["camera"].ravel(), drive.picture(view.time).ravel())[0, 1] > 0.999


@pytest.mark.parametrize("image_format", ["16UC1", "32FC1"])
def test_depth_is_no_picture(tmp_path: Path, image_format: str) -> None:
    setup = RosSetup(image_format=image_format)
    recording = read_recording(write_rosbag2(tmp_path / "bag", RobotDrive(seconds=1.0), setup))
    assert recording.sensors == {"laser"}


def test_stamps_of_zero_are_replaced_by_log_times(tmp_path: Path) -> None:
    recording = read_recording(write_rosbag2(tmp_path / "bag", DRIVE, RosSetup(stamped=False)))
    for view in recording.views:
        assert 0 <= view.time - DRIVE.start <= DRIVE.seconds + 0.01
    assert sum(view.distance for view in recording.views) == pytest.approx(
        DRIVE.speed * (DRIVE.seconds - 0.1), abs=0.05
    )


def test_types_that_are_not_read_are_counted(tmp_path: Path) -> None:
    class WithMore(RosMessages):
        def __iter__(self):  # type: ignore[no-untyped-def]
            yield from super().__iter__()
            logged = round(DRIVE.start * 1e9)
            yield BagMessage("/chatter", "std_msgs/msg/String", logged, self.type("std_msgs/String")("hello"))
            goal = self.type("geometry_msgs/PoseStamped")(
                self.header(DRIVE.start, "map"), self.pose(DRIVE.pose(DRIVE.start))
            )
            yield BagMessage("/move_base_simple/goal", "geometry_msgs/msg/PoseStamped", logged, goal)

    path = write_rosbag2(tmp_path / "bag", DRIVE, made_by=WithMore)
    assert read_recording(path).skipped == {"std_msgs/msg/String": 1, "geometry_msgs/msg/PoseStamped": 1}


def refusal(path: Path) -> str:
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(str(path), path.name)
