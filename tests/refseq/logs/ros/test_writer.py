"""Drives written as rosbag2: what ``rosbags`` and ``mcap-ros2-support`` read in them, and what our own reader does."""

import errno
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from refseq.errors import LogError
from refseq.logs import read_recording
from refseq.logs.rig import SensorRig
from refseq.logs.ros.writer import BagStorage, BagWriter
from refseq.logs.source import CameraCalibration
from refseq.logs.transforms import Transform, TransformTree
from refseq.planar import Pose, after_motion
from refseq.view import View
from tests.support import corridor_drive

CAMERAS = {"forward": "camera-1", "lateral": "camera-2"}
RIG = SensorRig(
    {
        "laser": Transform("", "", (0.3, 0.0, 0.2)),
        "camera-1": Transform("", "", (0.1, 0.0, 1.0), (0.5, -0.5, 0.5, -0.5)),
    },
    {
        "camera-1": CameraCalibration(
            64, 48, "plumb_bob", (0.1, 0.01, 0.0, 0.0, 0.0), (80.0, 0, 31.5, 0, 80.0, 23.5, 0, 0, 1)
        )
    },
)
METADATA = {"world": "hallway", "config": '{"a": "ü"}'}


def drive() -> tuple[list[View], list[Pose]]:
    """Views of the bench's own cameras, of which one lacks a camera, one its scan, one its truth; and the odometer."""
    views, poses, pose = [], [], Pose(2.0, -1.0, 3.0)
    for k, view in enumerate(corridor_drive(np.random.default_rng(1), 6, size=48)):
        images = {CAMERAS[name]: image for name, image in view.images.items() if (k, name) != (2, "lateral")}
        assert view.scan
        ranges = np.where(view.scan.ranges < 60, view.scan.ranges, np.inf).astype(np.float32)
        pose = after_motion(pose, view.distance, 0.1 * (k > 0))
        scan = None if k == 3 else replace(view.scan, ranges=ranges)
        turn, truth = 0.1 * (k > 0), None if k == 4 else view.truth
        views.append(replace(view, images=images, scan=scan, turn=turn, truth=truth, behaviour="MN" if k == 1 else ""))
        poses.append(pose)
    return views, poses


def write(path: Path, storage: BagStorage = BagStorage.MCAP, rig: SensorRig | None = None) -> list[View]:
    views, poses = drive()
    with BagWriter(path, METADATA, storage=storage, rig=rig) as writer:
        for view, pose in zip(views, poses, strict=True):
            writer.write(view, pose)
    return views


@pytest.mark.parametrize("storage", BagStorage)
@pytest.mark.parametrize("rig", [None, RIG])
def test_our_own_reader_gives_the_same_views(tmp_path: Path, storage: BagStorage, rig: SensorRig | None) -> None:
    views = write(tmp_path / "bag", storage, rig)
    recording = read_recording(tmp_path / "bag")
    assert recording.complete
    assert recording.metadata == METADATA
    assert len(recording.views) == len(views)
    for read, written in zip(recording.views, views, strict=True):
        assert (read.time, read.behaviour) == (written.time, written.behaviour)
        assert set(read.images) == set(written.images)
        for name, image in written.images.items():
            assert read.images[name].tobytes() == image.tobytes()
        assert (read.scan is None) == (written.scan is None)
        if read.scan and written.scan:
            assert read.scan.ranges.tobytes() == written.scan.ranges.tobytes()
            np.testing.assert_allclose(read.scan.bearings, written.scan.bearings, atol=1e-5)
            assert read.scan.max_range == written.scan.max_range
        assert (read.distance, read.turn) == pytest.approx((written.distance, written.turn), abs=1e-9)
        assert (read.truth is None) == (written.truth is None)
        if read.truth and written.truth:
            assert (read.truth.x, read.truth.y) == (written.truth.x, written.truth.y)
            assert read.truth.heading == pytest.approx(written.truth.heading, abs=1e-12)


def test_one_file_of_the_bag_alone(tmp_path: Path) -> None:
    views = write(tmp_path / "bag")
    recording = read_recording(tmp_path / "bag" / "bag.mcap")
    assert recording.metadata == METADATA
    assert [sorted(view.sensors) for view in recording.views] == [sorted(view.sensors) for view in views]


@pytest.mark.parametrize("storage", BagStorage)
def test_rosbags_reads_it(tmp_path: Path, storage: BagStorage) -> None:
    views = write(tmp_path / "bag", storage, RIG)
    found: dict[str, list[Any]] = {}
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, logged, raw in reader.messages():
            found.setdefault(connection.topic, []).append((logged, reader.deserialize(raw, connection.msgtype)))
    compare(found, views)
    with Reader(tmp_path / "bag") as bag:
        (latched,) = [connection.ext for connection in bag.connections if connection.topic == "/tf_static"]
        assert latched.offered_qos_profiles[0].durability.name == "TRANSIENT_LOCAL"  # type: ignore[union-attr]


def test_mcap_ros2_support_reads_it(tmp_path: Path) -> None:
    views = write(tmp_path / "bag", rig=RIG)
    found: dict[str, list[Any]] = {}
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        for _, channel, message, content in make_reader(
            file, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, content))
    compare(found, views)


def compare(found: dict[str, list[Any]], views: list[View]) -> None:
    """Compare messages as another project reads them with the views that were written."""
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/camera_1/image/compressed": 6,
        "/camera_1/camera_info": 6,
        "/camera_2/image/compressed": 5,
        "/scan": 5,
        "/odom": 6,
        "/ground_truth": 5,
        "/tf": 6,
        "/tf_static": 1,
        "/behaviour": 1,
    }
    by_time = {round(view.time * 1e9): view for view in views}
    for topic, messages in found.items():
        for logged, message in messages:
            if header := getattr(message, "header", None):
                assert header.stamp.sec * 10**9 + header.stamp.nanosec == logged, topic
    for logged, message in found["/camera_1/image/compressed"]:
        image = cv2.imdecode(np.frombuffer(bytes(message.data), np.uint8), cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(image, by_time[logged].images["camera-1"])
        assert message.format == "png"
    for logged, message in found["/scan"]:
        scan = by_time[logged].scan
        assert scan
        np.testing.assert_array_equal(np.array(message.ranges, np.float32), scan.ranges)
        assert message.angle_min + message.angle_increment * 360 == pytest.approx(math.pi / 2, abs=1e-5)
        assert message.header.frame_id == "laser"
    for logged, message in found["/ground_truth"]:
        truth = by_time[logged].truth
        assert truth
        assert (message.pose.position.x, message.pose.position.y) == (truth.x, truth.y)
        assert 2 * math.atan2(message.pose.orientation.z, message.pose.orientation.w) == pytest.approx(truth.heading)
    assert [message.data for _, message in found["/behaviour"]] == ["MN"]
    (_, info), *_ = found["/camera_1/camera_info"]
    assert (info.width, info.height, info.distortion_model) == (64, 48, "plumb_bob")
    assert list(info.k) == [80.0, 0, 31.5, 0, 80.0, 23.5, 0, 0, 1]
    assert list(info.d) == [0.1, 0.01, 0, 0, 0]


def test_transforms_lead_from_the_map_to_the_sensors(tmp_path: Path) -> None:
    """The chain map → odom → base_link is the true pose, odom → base_link the odometer's."""
    views = write(tmp_path / "bag", rig=RIG)
    tree = TransformTree()
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, logged, raw in reader.messages():
            if connection.topic in ("/tf", "/tf_static"):
                tree.add(list(transforms(reader.deserialize(raw, connection.msgtype), connection.topic)), logged / 1e9)
    way = tree.trajectory("base_link", "map")
    odometry = tree.trajectory("base_link", "odom")
    assert way
    assert odometry
    _, poses = drive()
    for k, (view, pose) in enumerate(zip(views, poses, strict=True)):
        np.testing.assert_allclose(odometry.at(view.time)[0, :2], (pose.x, pose.y), atol=1e-9)
        if view.truth:
            found = way.at(view.time)[0]
            assert found[:2] == pytest.approx((view.truth.x, view.truth.y), abs=1e-9), k
            assert math.remainder(found[2] - view.truth.heading, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    mount = tree.mount("laser", "base_link")
    assert mount
    assert (mount.x, mount.y, mount.yaw, mount.upside_down) == (0.3, 0.0, 0.0, False)


def transforms(message: Any, topic: str) -> Any:
    for one in message.transforms:
        by, turn = one.transform.translation, one.transform.rotation
        yield Transform(
            one.header.frame_id,
            one.child_frame_id,
            (by.x, by.y, by.z),
            (turn.x, turn.y, turn.z, turn.w),
            topic == "/tf_static",
        )


def test_a_bag_that_is_given_up_replaces_nothing(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    write(path)
    before = {file.name: file.read_bytes() for file in path.iterdir()}
    views, poses = drive()
    writer = BagWriter(path, {})
    writer.write(views[0], poses[0])
    assert {file.name: file.read_bytes() for file in path.iterdir()} == before, "while another is written"
    writer.discard()
    assert {file.name: file.read_bytes() for file in path.iterdir()} == before
    assert [file.name for file in tmp_path.iterdir()] == ["bag"]


def test_a_bag_that_is_finished_replaces_an_older_one(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    write(path, BagStorage.SQLITE3)
    views, poses = drive()
    with BagWriter(path, {}) as writer:
        writer.write(views[0], poses[0])
        writer.note({"end": "early"})
    assert sorted(file.name for file in path.iterdir()) == ["bag.mcap", "metadata.yaml"]
    assert [file.name for file in tmp_path.iterdir()] == ["bag"]
    recording = read_recording(path)
    assert (len(recording.views), recording.metadata) == (1, {"end": "early"})


@pytest.mark.parametrize("name", ["drive.txt", "metadata.yaml"])
def test_a_folder_of_something_else_is_kept(tmp_path: Path, name: str) -> None:
    path = tmp_path / "mine"
    write(path)
    if name == "metadata.yaml":
        (path / name).unlink()
    else:
        (path / name).write_text("my notes")
    with pytest.raises(LogError) as caught:
        BagWriter(path, {})
    other = "mine.mcap" if name == "metadata.yaml" else name
    assert str(caught.value) == f"{path}: is a folder with {other!r}; valid is a new name, or a bag to replace"


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"has a '\?' in its name; valid for a rosbag2 are names without"):
        BagWriter(tmp_path / "again?", {}, storage=BagStorage.SQLITE3)
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(LogError, match="is a file; valid for a rosbag2 is the name of a folder"):
        BagWriter(file, {})
    with pytest.raises(LogError, match=r"bag: cannot be written: No such file or directory$"):
        BagWriter(tmp_path / "no" / "bag", {})


def test_a_bag_lies_where_a_link_leads_to(tmp_path: Path) -> None:
    (disk := tmp_path / "disk").mkdir()
    (link := tmp_path / "bag").symlink_to("disk/today")
    for _ in range(2):
        write(link)
        assert link.is_symlink()
        assert {file.name for file in (disk / "today").iterdir()} == {"metadata.yaml", "today.mcap"}
    assert [file.name for file in disk.iterdir()] == ["today"]


def test_views_that_a_bag_cannot_hold(tmp_path: Path) -> None:
    image = np.zeros((4, 4), np.uint8)
    writer = BagWriter(tmp_path / "bag", {})
    with pytest.raises(LogError, match=r"a view is at -1 s; valid are seconds from 0 to 2147483648"):
        writer.write(View(-1.0), Pose(0, 0, 0))
    with pytest.raises(LogError, match="cameras 'a-b' and 'a_b' would share topic /a_b/image/compressed"):
        writer.write(View(0.0, {"a-b": image, "a_b": image}), Pose(0, 0, 0))
    writer.discard()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("storage", BagStorage)
def test_nothing_stays_of_a_bag_that_could_not_be_begun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, storage: BagStorage
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("refseq.logs.ros.writer.Writer.open", full)
    with pytest.raises(LogError, match=r"bag: cannot be written: No space left on device$"):
        BagWriter(tmp_path / "bag", {}, storage=storage)
    assert list(tmp_path.iterdir()) == []
