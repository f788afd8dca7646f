"""Bags of a robot's drive as other projects write them: ``rosbags`` for ROS 1 and 2, ``mcap-ros2-support`` for MCAP.

Nothing of ours takes part in writing, so that reading is checked against software that robots' owners use.
"""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as McapRos2Writer
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from refseq.planar import Pose, relative_pose
from tests.refseq.logs.robot_drive import HERE, Moment, RobotDrive, Sense

BEAMS = 181
ENCODINGS = {
    "rgb8": cv2.COLOR_GRAY2RGB,
    "bgr8": cv2.COLOR_GRAY2BGR,
    "rgba8": cv2.COLOR_GRAY2RGBA,
    "bgra8": cv2.COLOR_GRAY2BGRA,
}


@dataclass(frozen=True)
class RosSetup:
    """Set-up of the robot's software.

    ``image_format`` is ``png`` or ``jpeg`` for CompressedImage, else the encoding of an Image. ``odometry`` and
    ``truth`` come on a ``topic``, by ``tf`` or not at all (None). The laser lies at ``laser`` on the robot,
    ``upside_down`` or not, and tells so on ``/tf_static`` if ``mounts``. Without ``stamped`` all header stamps are
    zero.
    """

    image_format: str | None = "png"
    scans: bool = True
    odometry: str | None = "topic"
    truth: str | None = "topic"
    laser: Pose = HERE
    upside_down: bool = False
    mounts: bool = True
    stamped: bool = True


class BagMessage(NamedTuple):
    """A message as a bag holds it; ``logged`` [ns]."""

    topic: str
    type: str
    logged: int
    content: Any


class RosMessages:
    """A drive's messages in the types of a ROS distribution."""

    def __init__(self, drive: RobotDrive, setup: RosSetup, distribution: Stores) -> None:
        self.drive = drive
        self.setup = setup
        self.store = get_typestore(distribution)
        self._ros1 = distribution is Stores.ROS1_NOETIC
        if self._ros1:
            lines = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(lines, "tf2_msgs/msg/TFMessage"))
        self.bearings = np.radians(np.linspace(-90.0, 90.0, BEAMS))

    def type(self, name: str) -> Any:
        """The message class of ``package/Name``."""
        return self.store.types[name.replace("/", "/msg/")]

    def __iter__(self) -> Iterator[BagMessage]:
        first = round(self.drive.moments[0].logged * 1e9)
        if self.setup.mounts:
            yield BagMessage("/tf_static", "tf2_msgs/msg/TFMessage", first, self._mounts())
        for moment in self.drive.moments:
            yield from self._messages(moment)

    def _messages(self, moment: Moment) -> Iterator[BagMessage]:
        time, logged, setup = moment.time, round(moment.logged * 1e9), self.setup
        match moment.sense:
            case Sense.PICTURE if setup.image_format in ("png", "jpeg"):
                content = self._compressed(time)
                yield BagMessage("/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage", logged, content)
            case Sense.PICTURE if setup.image_format:
                yield BagMessage("/camera/image_raw", "sensor_msgs/msg/Image", logged, self._image(time))
            case Sense.SCAN if setup.scans:
                yield BagMessage("/scan", "sensor_msgs/msg/LaserScan", logged, self._scan(time))
            case Sense.ODOMETRY if setup.odometry == "topic":
                yield BagMessage("/odom", "nav_msgs/msg/Odometry", logged, self._odometry(time))
            case Sense.ODOMETRY if setup.odometry == "tf":
                moved = self.transform("odom", "base_link", self.drive.odometry(time), time)
                yield BagMessage("/tf", "tf2_msgs/msg/TFMessage", logged, self._transforms(moved))
            case Sense.TRUTH if setup.truth == "topic":
                content = self.type("geometry_msgs/PoseStamped")(
                    self.header(time, "map"), self.pose(self.drive.pose(time))
                )
                yield BagMessage("/ground_truth", "geometry_msgs/msg/PoseStamped", logged, content)
            case Sense.TRUTH if setup.truth == "tf":
                corrected = self.transform("map", "odom", self._map_to_odom(time), time)
                yield BagMessage("/tf", "tf2_msgs/msg/TFMessage", logged, self._transforms(corrected))

    def header(self, time: float, frame: str) -> Any:
        """A header with the sensor's stamp, or zero."""
        nanoseconds = round(time * 1e9) if self.setup.stamped else 0
        stamp = self.type("builtin_interfaces/Time")(*divmod(nanoseconds, 10**9))
        return self.type("std_msgs/Header")(*([0] if self._ros1 else []), stamp, frame)

    def pose(self, pose: Pose) -> Any:
        """A pose message in the plane."""
        point = self.type("geometry_msgs/Point")(pose.x, pose.y, 0.0)
        return self.type("geometry_msgs/Pose")(point, self._turn(pose.heading))

    def _turn(self, yaw: float, upside_down: bool = False) -> Any:
        c, s = math.cos(yaw / 2), math.sin(yaw / 2)
        # A roll by π comes first: Rz(yaw) Rx(π).
        x, y, z, w = (c, s, 0.0, 0.0) if upside_down else (0.0, 0.0, s, c)
        return self.type("geometry_msgs/Quaternion")(x, y, z, w)

    def transform(self, parent: str, child: str, pose: Pose, time: float, *, upside_down: bool = False) -> Any:
        """A stamped transform in the plane, or of a thing mounted upside down."""
        translation = self.type("geometry_msgs/Vector3")(pose.x, pose.y, 0.2)
        moved = self.type("geometry_msgs/Transform")(translation, self._turn(pose.heading, upside_down))
        return self.type("geometry_msgs/TransformStamped")(self.header(time, parent), child, moved)

    def _transforms(self, *transforms: Any) -> Any:
        return self.type("tf2_msgs/TFMessage")(list(transforms))

    def _mounts(self) -> Any:
        time = self.drive.moments[0].time
        laser = self.transform("base_link", "laser", self.setup.laser, time, upside_down=self.setup.upside_down)
        return self._transforms(laser, self.transform("base_link", "camera", Pose(0.2, 0.0, 0.0), time))

    def _map_to_odom(self, time: float) -> Pose:
        odom_in_robot = relative_pose(HERE, self.drive.odometry(time))
        robot = self.drive.pose(time)
        cos, sin = math.cos(robot.heading), math.sin(robot.heading)
        return Pose(
            robot.x + cos * odom_in_robot.x - sin * odom_in_robot.y,
            robot.y + sin * odom_in_robot.x + cos * odom_in_robot.y,
            robot.heading + odom_in_robot.heading,
        )

    def _stamp(self, time: float) -> float:
        """The camera's stamp, which may be late."""
        return time + self.drive.camera_delay

    def _compressed(self, time: float) -> Any:
        kind = self.setup.image_format
        data = cv2.imencode(".png" if kind == "png" else ".jpg", self.drive.picture(time))[1].ravel()
        return self.type("sensor_msgs/CompressedImage")(self.header(self._stamp(time), "camera"), str(kind), data)

    def _image(self, time: float) -> Any:
        encoding, grey = str(self.setup.image_format), self.drive.picture(time)
        if encoding == "mono16":
            pixels = grey.astype(np.uint16) * 257
        elif encoding == "32FC1":
            pixels = grey.astype(np.float32)
        elif encoding == "16UC1":
            pixels = grey.astype(np.uint16) * 10
        else:
            change = ENCODINGS.get(encoding)
            pixels = grey if change is None else cv2.cvtColor(grey, change)
        rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(grey), -1)
        padded = np.pad(rows, ((0, 0), (0, 4)))  # rows that are longer than their pixels are allowed
        return self.type("sensor_msgs/Image")(
            self.header(self._stamp(time), "camera"),
            grey.shape[0],
            grey.shape[1],
            encoding,
            0,
            padded.shape[1],
            padded.ravel(),
        )

    def _scan(self, time: float) -> Any:
        way = -self.bearings if self.setup.upside_down else self.bearings
        ranges = self.drive.ranges(time, way, self.setup.laser)
        step = float(self.bearings[1] - self.bearings[0])
        return self.type("sensor_msgs/LaserScan")(
            self.header(time, "laser"),
            float(self.bearings[0]),
            float(self.bearings[-1]),
            step,
            0.0,
            1 / self.drive.laser_rate,
            0.05,
            25.0,
            ranges,
            np.zeros(0, np.float32),
        )

    def _odometry(self, time: float) -> Any:
        covariance = np.zeros(36)
        pose = self.type("geometry_msgs/PoseWithCovariance")(self.pose(self.drive.odometry(time)), covariance)
        still = self.type("geometry_msgs/Vector3")(0.0, 0.0, 0.0)
        twist = self.type("geometry_msgs/TwistWithCovariance")(
            self.type("geometry_msgs/Twist")(still, still), covariance
        )
        return self.type("nav_msgs/Odometry")(self.header(time, "odom"), "base_link", pose, twist)


def write_rosbag2(
    folder: Path,
    drive: RobotDrive,
    setup: RosSetup | None = None,
    storage: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    made_by: type[RosMessages] = RosMessages,
) -> Path:
    """Write a rosbag2 folder by ``rosbags``."""
    messages = made_by(drive, setup or RosSetup(), Stores.ROS2_HUMBLE)
    writer = Rosbag2Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        write_messages(writer, messages, messages.store)
    return folder


def write_messages(writer: Rosbag2Writer, messages: Iterator[BagMessage] | RosMessages, store: Typestore) -> None:
    """Write messages to an open rosbag2."""
    connections: dict[str, Any] = {}
    for topic, kind, logged, content in messages:
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, kind, typestore=store)
        writer.write(connections[topic], logged, store.serialize_cdr(content, kind))


def write_rosbag1(
    path: Path,
    drive: RobotDrive,
    setup: RosSetup | None = None,
    compression: Rosbag1Writer.CompressionFormat | None = None,
) -> Path:
    """Write a ROS 1 bag by ``rosbags``."""
    messages = RosMessages(drive, setup or RosSetup(), Stores.ROS1_NOETIC)
    writer = Rosbag1Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    connections: dict[str, Any] = {}
    with writer:
        for topic, kind, logged, content in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.store)
            writer.write(connections[topic], logged, messages.store.serialize_ros1(content, kind))
    return path


def write_ros2_mcap(path: Path, drive: RobotDrive, setup: RosSetup | None = None) -> Path:
    """Write an MCAP file with CDR messages by ``mcap-ros2-support``."""
    messages = RosMessages(drive, setup or RosSetup(), Stores.ROS2_HUMBLE)
    schemas: dict[str, Any] = {}
    with path.open("wb") as file, McapRos2Writer(file) as writer:
        for topic, kind, logged, content in messages:
            if kind not in schemas:
                text = messages.store.generate_msgdef(kind, ros_version=2)[0]
                schemas[kind] = writer.register_msgdef(kind, text)
            writer.write_message(topic, schemas[kind], plain(content), logged)
    return path


def write_plain_mcap(path: Path, drive: RobotDrive, setup: RosSetup | None, distribution: Stores) -> Path:
    """Write an MCAP file without a profile by ``mcap``, as converters do, of ROS 2 or ROS 1."""
    messages = RosMessages(drive, setup or RosSetup(), distribution)
    ros1 = distribution is Stores.ROS1_NOETIC
    serialize = messages.store.serialize_ros1 if ros1 else messages.store.serialize_cdr
    channels: dict[str, int] = {}
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        for topic, kind, logged, content in messages:
            if topic not in channels:
                name, encoding = (kind.replace("/msg/", "/"), "ros1msg") if ros1 else (kind, "ros2msg")
                schema = writer.register_schema(name, encoding, b"")
                channels[topic] = writer.register_channel(topic, "ros1" if ros1 else "cdr", schema)
            writer.add_message(channels[topic], logged, bytes(serialize(content, kind)), logged)
        writer.finish()
    return path


def plain(content: Any) -> Any:
    """A message as dictionaries, lists and numbers."""
    if dataclasses.is_dataclass(content):
        return {field.name: plain(getattr(content, field.name)) for field in dataclasses.fields(content)}
    if isinstance(content, np.ndarray):
        return content.tobytes() if content.dtype == np.uint8 else content.tolist()
    return [plain(one) for one in content] if isinstance(content, list) else content
