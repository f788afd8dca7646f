"""Views as ROS 2 messages: standard types on the topics and in the frames that ROS' own tools expect (REP 105).

Frames are ``map`` (truth) → ``odom`` (odometry) → ``base_link`` → sensors, where their mounts are known; a scan of
unknown mount is told in ``base_link``, whose forward direction a view's bearings start from.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from rosbags.typesys.store import Typestore

from refseq.errors import LogError
from refseq.logs.foxglove.outgoing import FAST_PNG
from refseq.logs.rig import SensorRig
from refseq.logs.ros.contents import BEHAVIOUR_TOPIC, STATIC_TOPIC
from refseq.logs.source import NANOSECONDS, CameraCalibration
from refseq.logs.transforms import Transform
from refseq.planar import Pose, in_world, relative_pose
from refseq.view import LASER, Scan, View

MAP, ODOM, BASE = "map", "odom", "base_link"
SCAN_TOPIC, ODOMETRY_TOPIC, TRUTH_TOPIC, TRANSFORM_TOPIC = "/scan", "/odom", "/ground_truth", "/tf"
HERE = Pose(0.0, 0.0, 0.0)


class RosMessage(NamedTuple):
    """A message to be logged on a topic."""

    topic: str
    type: str
    content: Any


class ViewMessages:
    """Makes the messages of views; poses of the odometer and truth are in the plane."""

    def __init__(self, store: Typestore, rig: SensorRig) -> None:
        self._store = store
        self._rig = rig

    def fixed(self, nanoseconds: int) -> Iterator[RosMessage]:
        """Messages that are true for the whole drive: the mounts."""
        mounts = [
            self._stamped_transform(replace(mount, parent=BASE, child=sensor), nanoseconds)
            for sensor, mount in self._rig.mounts.items()
        ]
        if mounts:
            yield self._transforms(STATIC_TOPIC, mounts)

    def of(self, view: View, odometry: Pose) -> Iterator[RosMessage]:
        """Messages of one view, all of its time."""
        nanoseconds = round(view.time * NANOSECONDS)
        for camera, image in view.images.items():
            yield from self._picture(camera, image, nanoseconds)
        if view.scan is not None:
            yield RosMessage(SCAN_TOPIC, "sensor_msgs/msg/LaserScan", self._scan(view.scan, nanoseconds))
        yield RosMessage(ODOMETRY_TOPIC, "nav_msgs/msg/Odometry", self._odometry(odometry, nanoseconds))
        moved = [Transform(ODOM, BASE, (odometry.x, odometry.y, 0.0), _quaternion(odometry.heading))]
        if view.truth is not None:
            truth = self._new("geometry_msgs/PoseStamped", self._header(nanoseconds, MAP), self._pose(view.truth))
            yield RosMessage(TRUTH_TOPIC, "geometry_msgs/msg/PoseStamped", truth)
            odom = _origin(view.truth, odometry)
            moved.append(Transform(MAP, ODOM, (odom.x, odom.y, 0.0), _quaternion(odom.heading)))
        yield self._transforms(TRANSFORM_TOPIC, [self._stamped_transform(one, nanoseconds) for one in moved])
        if view.behaviour:
            yield RosMessage(BEHAVIOUR_TOPIC, "std_msgs/msg/String", self._new("std_msgs/String", view.behaviour))

    def _new(self, name: str, *values: Any) -> Any:
        return self._store.types[name.replace("/", "/msg/")](*values)

    def _header(self, nanoseconds: int, frame: str) -> Any:
        stamp = self._new("builtin_interfaces/Time", *divmod(nanoseconds, NANOSECONDS))
        return self._new("std_msgs/Header", stamp, frame)

    def _pose(self, pose: Pose) -> Any:
        turn = self._new("geometry_msgs/Quaternion", *_quaternion(pose.heading))
        return self._new("geometry_msgs/Pose", self._new("geometry_msgs/Point", pose.x, pose.y, 0.0), turn)

    def _picture(self, camera: str, image: np.ndarray[Any, Any], nanoseconds: int) -> Iterator[RosMessage]:
        data = cv2.imencode(".png", image, FAST_PNG)[1].ravel()
        header = self._header(nanoseconds, camera)
        picture = self._new("sensor_msgs/CompressedImage", header, "png", data)
        yield RosMessage(camera_topic(camera), "sensor_msgs/msg/CompressedImage", picture)
        if (model := self._rig.calibrations.get(camera)) is not None:
            info = self._calibration(model, header)
            yield RosMessage(f"{_camera_space(camera)}/camera_info", "sensor_msgs/msg/CameraInfo", info)

    def _calibration(self, model: CameraCalibration, header: Any) -> Any:
        whole = self._new("sensor_msgs/RegionOfInterest", 0, 0, 0, 0, False)
        matrix = np.array(model.matrix, np.float64)
        projection = np.hstack([matrix.reshape(3, 3), np.zeros((3, 1))]).ravel()
        distortion = np.array(model.distortion, np.float64)
        size = model.height, model.width
        numbers = distortion, matrix, np.eye(3).ravel(), projection
        return self._new("sensor_msgs/CameraInfo", header, *size, model.model, *numbers, 0, 0, whole)

    def _scan(self, scan: Scan, nanoseconds: int) -> Any:
        frame = LASER if LASER in self._rig.mounts else BASE
        ends = float(scan.bearings[0]), float(scan.bearings[-1])
        ranges = np.ascontiguousarray(scan.ranges, np.float32)
        limits = 0.0, scan.max_range
        header = self._header(nanoseconds, frame)
        return self._new("sensor_msgs/LaserScan", header, *ends, scan.step, 0.0, 0.0, *limits, ranges, ranges[:0])

    def _odometry(self, odometry: Pose, nanoseconds: int) -> Any:
        unknown = np.zeros(36)
        still = self._new("geometry_msgs/Vector3", 0.0, 0.0, 0.0)
        pose = self._new("geometry_msgs/PoseWithCovariance", self._pose(odometry), unknown)
        twist = self._new("geometry_msgs/Twist", still, still)
        speed = self._new("geometry_msgs/TwistWithCovariance", twist, unknown)
        return self._new("nav_msgs/Odometry", self._header(nanoseconds, ODOM), BASE, pose, speed)

    def _transforms(self, topic: str, transforms: list[Any]) -> RosMessage:
        return RosMessage(topic, "tf2_msgs/msg/TFMessage", self._new("tf2_msgs/TFMessage", transforms))

    def _stamped_transform(self, one: Transform, nanoseconds: int) -> Any:
        by = self._new("geometry_msgs/Vector3", *one.translation)
        moved = self._new("geometry_msgs/Transform", by, self._new("geometry_msgs/Quaternion", *one.rotation))
        return self._new("geometry_msgs/TransformStamped", self._header(nanoseconds, one.parent), one.child, moved)


def camera_topic(camera: str) -> str:
    """The topic of a camera's pictures."""
    return f"{_camera_space(camera)}/image/compressed"


def camera_topics(cameras: Sequence[str]) -> dict[str, str]:
    """Cameras by topic. Raises ``LogError`` for two of one topic."""
    topics: dict[str, str] = {}
    for camera in cameras:
        topic = camera_topic(camera)
        if topic in topics:
            raise LogError(f"cameras {topics[topic]!r} and {camera!r} would share topic {topic}; valid are other names")
        topics[topic] = camera
    return topics


def _camera_space(camera: str) -> str:
    """A camera's name as ROS allows it in a topic: letters, digits and underscores, no digit first."""
    word = re.sub(r"[^A-Za-z0-9_]", "_", camera)
    return f"/{'_' if word[:1].isdigit() else ''}{word}"


def _quaternion(heading: float) -> tuple[float, float, float, float]:
    return 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)


def _origin(truth: Pose, odometry: Pose) -> Pose:
    """The odometer's frame in the map: from where its pose would lead to the true one."""
    back = relative_pose(HERE, odometry)
    x, y = in_world((back.x, back.y), truth).tolist()
    return Pose(x, y, truth.heading + back.heading)
