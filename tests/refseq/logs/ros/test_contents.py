"""Messages of types that few logs have, written by ``rosbags`` and read by ours."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from refseq.errors import LogError
from refseq.logs.ros.decoder import RosDecoder, Serialization
from refseq.logs.source import AngularRates, CameraCalibration, GeoFix, Role, Sample
from refseq.planar import Pose
from refseq.view import Scan

STORE = get_typestore(Stores.ROS2_HUMBLE)
HALF = math.sqrt(0.5)
NAN = float("nan")


def made(name: str, *fields: Any) -> Any:
    return STORE.types[name.replace("/", "/msg/")](*fields)


def header(frame: str = "base") -> Any:
    return made("std_msgs/Header", made("builtin_interfaces/Time", 12, 500_000_000), frame)


def read(topic: str, message: Any) -> Sample | None:
    name = message.__msgtype__
    return RosDecoder(Serialization.CDR).sample(topic, name, 13_000_000_000, bytes(STORE.serialize_cdr(message, name)))


def turned_left(x: float, y: float) -> tuple[Any, Any]:
    """A place, and a quarter turn to the left."""
    return (x, y, 0.3), made("geometry_msgs/Quaternion", 0.0, 0.0, HALF, HALF)


def test_of_several_echoes_the_first_counts() -> None:
    echoes: Sequence[list[float]] = ([2.0, 5.0], [], [3.0])
    ranges = [made("sensor_msgs/LaserEcho", np.array(one, np.float32)) for one in echoes]
    scan = made("sensor_msgs/MultiEchoLaserScan", header("laser"), -0.5, 0.5, 0.5, 0.0, 0.1, 0.1, 30.0, ranges, [])
    found = read("/scan", scan)
    assert found is not None
    assert isinstance(found.content, Scan)
    first, nothing, last = found.content.ranges.tolist()
    assert (first, last) == (2.0, 3.0)
    assert not 0.1 <= nothing <= 30.0
    assert (found.time, found.logged, found.frame) == (12.5, 13.0, "laser")


def moved_to(frame: str, child: str, x: float, y: float) -> Any:
    """A transform that turns left."""
    at, turn = turned_left(x, y)
    moved = made("geometry_msgs/Transform", made("geometry_msgs/Vector3", *at), turn)
    return made("geometry_msgs/TransformStamped", header(frame), child, moved)


def test_a_body_followed_by_cameras_on_the_wall_is_the_truth() -> None:
    message = moved_to("vicon", "/robot", 1.0, 2.0)
    found = read("/vicon/robot", message)
    assert found is not None
    assert isinstance(found.content, Pose)
    assert (found.content.x, found.content.y, found.content.heading) == pytest.approx((1.0, 2.0, math.pi / 2))
    assert (found.frame, found.child) == ("vicon", "robot")
    assert RosDecoder(Serialization.CDR).role("/vicon/robot", message.__msgtype__) is Role.TRUTH


def test_transforms_without_end_in_one_message_are_damage() -> None:
    again = [moved_to("odom", "base_link", 0.0, 0.0)] * 4097
    with pytest.raises(LogError, match="a message has 4097 coordinate frames in a log; valid are at most 4096"):
        read("/tf", made("tf2_msgs/TFMessage", again))


@pytest.mark.parametrize("uncertain", [True, False])
def test_poses_are_read_with_and_without_their_uncertainty(*, uncertain: bool) -> None:
    at, turn = turned_left(4.0, -1.0)
    pose = made("geometry_msgs/Pose", made("geometry_msgs/Point", *at), turn)
    if uncertain:
        pose = made("geometry_msgs/PoseWithCovariance", pose, np.zeros(36))
    name = "PoseWithCovarianceStamped" if uncertain else "PoseStamped"
    found = read("/truth", made(f"geometry_msgs/{name}", header(), pose))
    assert found is not None
    assert found.content == Pose(4.0, -1.0, pytest.approx(math.pi / 2))


@pytest.mark.parametrize(
    ("status", "place", "content"),
    [
        (0, (38.7, -9.1, 120.0), GeoFix(38.7, -9.1, 120.0)),
        (2, (38.7, -9.1, NAN), GeoFix(38.7, -9.1, 0.0)),
        (-1, (0.0, 0.0, 0.0), None),  # it has none yet
        (0, (NAN, -9.1, 120.0), None),
    ],
)
def test_satellites_tell_a_place_only_where_there_is_one(
    status: int, place: tuple[float, ...], content: GeoFix | None
) -> None:
    fix = made("sensor_msgs/NavSatFix", header(), made("sensor_msgs/NavSatStatus", status, 1), *place, np.zeros(9), 0)
    found = read("/fix", fix)
    assert (found and found.content) == content


def test_rates_and_calibrations_are_taken_as_they_are() -> None:
    still, spin = made("geometry_msgs/Vector3", 0.0, 0.0, 9.8), made("geometry_msgs/Vector3", 0.1, -0.2, 0.3)
    turn = made("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0)
    nine = np.zeros(9)
    found = read("/imu", made("sensor_msgs/Imu", header(), turn, nine, spin, nine, still, nine))
    assert found is not None
    assert found.content == AngularRates(0.1, -0.2, 0.3)
    matrix = np.array([400.0, 0, 320, 0, 400, 240, 0, 0, 1])
    region = made("sensor_msgs/RegionOfInterest", 0, 0, 0, 0, False)
    info = made(
        "sensor_msgs/CameraInfo",
        header("camera"),
        480,
        640,
        "plumb_bob",
        np.array([-0.2, 0.1, 0.0, 0.0, 0.0]),
        matrix,
        np.eye(3).ravel(),
        np.zeros(12),
        0,
        0,
        region,
    )
    found = read("/camera_info", info)
    assert found is not None
    assert found.content == CameraCalibration(640, 480, "plumb_bob", (-0.2, 0.1, 0.0, 0.0, 0.0), tuple(matrix.tolist()))


def test_transforms_of_none_tell_nothing() -> None:
    assert read("/tf", made("tf2_msgs/TFMessage", [])) is None
