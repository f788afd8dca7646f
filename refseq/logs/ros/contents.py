"""Contents of ROS messages, by type: what each of them is used for, and how it becomes a sample."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from refseq.limits import BEAMS, FRAMES
from refseq.logs.decoding.picture import CompressedPicture, RawPicture
from refseq.logs.scans import scan_of
from refseq.logs.source import NANOSECONDS, AngularRates, CameraCalibration, Content, GeoFix, Role
from refseq.logs.transforms import Transform, pose_in_plane, pose_of_message

TRUTH_WORDS = ("truth", "groundtruth", "mocap", "vicon", "optitrack")
"""An Odometry on a topic of such a name is no odometer's."""
COMMAND_WORDS = ("goal", "initialpose", "target", "waypoint")
"""A pose on a topic of such a name is where the robot is to go, or was thought to start."""
BEHAVIOUR_TOPIC = "/behaviour"
STATIC_TOPIC = "/tf_static"


class RosContent(NamedTuple):
    """A message's stamp [ns], frames and content; ``content`` None: it tells nothing (a pose that is no number)."""

    stamp: int
    frame: str
    content: Content | None
    child: str = ""


@dataclass(frozen=True, slots=True)
class RosType:
    """Use of a message type, and the converter of a message on a topic."""

    role: Role
    content_of: Callable[[Any, str], RosContent]


def role_of(type_name: str, topic: str) -> Role:
    """Use that the bench has for messages of ``type_name`` (``sensor_msgs/msg/Imu``) on a topic."""
    known = ROS_TYPES.get(type_name)
    if known is None:
        return Role.IGNORED
    words = topic.lower()
    match known.role:
        case Role.ODOMETRY if any(word in words for word in TRUTH_WORDS):
            return Role.TRUTH
        case Role.TRUTH if any(word in words for word in COMMAND_WORDS):
            return Role.IGNORED
        case Role.BEHAVIOUR if topic != BEHAVIOUR_TOPIC:
            return Role.IGNORED
        case role:
            return role


def _headed(message: Any, content: Content | None, child: str = "") -> RosContent:
    """Stamp and frame of a message's header with its content."""
    stamp = message.header.stamp
    return RosContent(stamp.sec * NANOSECONDS + stamp.nanosec, message.header.frame_id, content, child)


def _compressed(message: Any, topic: str) -> RosContent:
    return _headed(message, CompressedPicture(message.data.tobytes(), message.format))


def _image(message: Any, topic: str) -> RosContent:
    data, big = message.data.tobytes(), bool(message.is_bigendian)
    picture = RawPicture(data, message.encoding, message.width, message.height, message.step, big)
    return _headed(message, picture)


def _scan(message: Any, topic: str) -> RosContent:
    return _headed(message, scan_of(message.ranges, *_angles(message)))


def _first_echoes(message: Any, topic: str) -> RosContent:
    BEAMS.check(len(message.ranges), "a message has")
    first = [echo.echoes[0] if len(echo.echoes) else np.inf for echo in message.ranges]
    return _headed(message, scan_of(first, *_angles(message)))


def _angles(message: Any) -> tuple[float, float, float, float]:
    return message.angle_min, message.angle_increment, message.range_min, message.range_max


def _odometry(message: Any, topic: str) -> RosContent:
    return _headed(message, pose_of_message(message.pose.pose), message.child_frame_id)


def _stamped_pose(message: Any, topic: str) -> RosContent:
    return _headed(message, pose_of_message(message.pose))


def _uncertain_pose(message: Any, topic: str) -> RosContent:
    return _headed(message, pose_of_message(message.pose.pose))


def _tracked(message: Any, topic: str) -> RosContent:
    """A body followed by a motion-capture system, as its bridge for ROS tells it."""
    moved = _transform(message, static=False)
    return _headed(message, pose_in_plane(moved.translation, moved.rotation), moved.child)


def _transforms(message: Any, topic: str) -> RosContent:
    static = topic == STATIC_TOPIC
    FRAMES.check(len(message.transforms), "a message has")
    moved = tuple(_transform(one, static=static) for one in message.transforms)
    if not moved:
        return RosContent(0, "", None)
    return _headed(message.transforms[0], moved)


def _transform(message: Any, *, static: bool) -> Transform:
    by, turn = message.transform.translation, message.transform.rotation
    # The first tf put a slash before the names of frames, tf2 does not.
    parent, child = message.header.frame_id.lstrip("/"), message.child_frame_id.lstrip("/")
    return Transform(parent, child, (by.x, by.y, by.z), (turn.x, turn.y, turn.z, turn.w), static)


def _rates(message: Any, topic: str) -> RosContent:
    rates = message.angular_velocity
    return _headed(message, AngularRates(rates.x, rates.y, rates.z))


def _fix(message: Any, topic: str) -> RosContent:
    """A position by satellites; receivers send a status below 0, or no numbers, while they have none."""
    known = message.status.status >= 0 and np.isfinite((message.latitude, message.longitude)).all()
    altitude = message.altitude if np.isfinite(message.altitude) else 0.0
    return _headed(message, GeoFix(message.latitude, message.longitude, altitude) if known else None)


def _calibration(message: Any, topic: str) -> RosContent:
    # ROS 1 spells the names of the matrices in capitals.
    distortion, matrix = (message.D, message.K) if hasattr(message, "K") else (message.d, message.k)
    numbers = tuple(map(float, distortion)), tuple(map(float, matrix))
    return _headed(message, CameraCalibration(message.width, message.height, message.distortion_model, *numbers))


def _note(message: Any, topic: str) -> RosContent:
    return RosContent(0, "", message.data)


ROS_TYPES: Mapping[str, RosType] = {
    "sensor_msgs/msg/CompressedImage": RosType(Role.CAMERA, _compressed),
    "sensor_msgs/msg/Image": RosType(Role.CAMERA, _image),
    "sensor_msgs/msg/LaserScan": RosType(Role.LASER, _scan),
    "sensor_msgs/msg/MultiEchoLaserScan": RosType(Role.LASER, _first_echoes),
    "nav_msgs/msg/Odometry": RosType(Role.ODOMETRY, _odometry),
    "geometry_msgs/msg/PoseStamped": RosType(Role.TRUTH, _stamped_pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": RosType(Role.TRUTH, _uncertain_pose),
    "geometry_msgs/msg/TransformStamped": RosType(Role.TRUTH, _tracked),
    "tf2_msgs/msg/TFMessage": RosType(Role.TRANSFORMS, _transforms),
    "tf/msg/tfMessage": RosType(Role.TRANSFORMS, _transforms),
    "sensor_msgs/msg/Imu": RosType(Role.IMU, _rates),
    "sensor_msgs/msg/NavSatFix": RosType(Role.GPS, _fix),
    "sensor_msgs/msg/CameraInfo": RosType(Role.CALIBRATION, _calibration),
    "std_msgs/msg/String": RosType(Role.BEHAVIOUR, _note),
}
"""Types that are read; all others are counted and passed over."""
