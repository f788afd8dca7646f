"""The robot's drive as a Foxglove log: the foxglove SDK writes Protobuf, the mcap library JSON."""

import base64
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import foxglove
import numpy as np
from foxglove import channels, messages
from foxglove.mcap import MCAPWriteOptions
from mcap.writer import Writer

from refseq.planar import Pose
from tests.refseq.logs.robot_drive import Moment, RobotDrive, Sense

BEARINGS = np.linspace(-math.pi / 2, math.pi / 2, 181)
TOPICS = {
    Sense.PICTURE: "/cam0/image_raw/compressed",
    Sense.SCAN: "/scan",
    Sense.ODOMETRY: "/odom",
    Sense.TRUTH: "/ground_truth",
}


@dataclass(frozen=True)
class FoxgloveSetup:
    """Form of the log: ``raw`` is an encoding of RawImage, ``tf`` gives odometry and truth as transforms.

    Pictures between the times of ``cut``, in seconds from the start, end in the middle.
    """

    raw: str | None = None
    tf: bool = False
    odometry: bool = True
    truth: bool = True
    stamped: bool = True
    cut: tuple[float, float] = (math.inf, math.inf)


def ns(time: float) -> int:
    return round(time * 1e9)


def pose_message(pose: Pose) -> messages.Pose:
    half = pose.heading / 2
    return messages.Pose(
        position=messages.Vector3(x=pose.x, y=pose.y, z=0.1),
        orientation=messages.Quaternion(x=0, y=0, z=math.sin(half), w=math.cos(half)),
    )


def write_foxglove(path: Path, drive: RobotDrive, setup: FoxgloveSetup = FoxgloveSetup()) -> Path:
    """Write the drive with the SDK of Foxglove."""
    context = foxglove.Context()
    made: dict[str, Any] = {}
    options = MCAPWriteOptions(chunk_size=40_000)  # of a log that is cut off whole chunks are read
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context, writer_options=options):
        for moment in drive.moments:
            for topic, message in _messages(drive, moment, setup):
                kind = type(message).__name__
                if topic not in made:
                    made[topic] = getattr(channels, f"{kind}Channel")(topic, context=context)
                made[topic].log(message, log_time=ns(moment.logged))
    return path


def _messages(drive: RobotDrive, moment: Moment, setup: FoxgloveSetup) -> list[tuple[str, Any]]:
    nanoseconds = ns(moment.time) if setup.stamped else 0
    stamp = messages.Timestamp(sec=nanoseconds // 10**9, nsec=nanoseconds % 10**9)
    topic = TOPICS[moment.sense]
    match moment.sense:
        case Sense.PICTURE:
            cut = setup.cut[0] < moment.time - drive.start < setup.cut[1]
            return [(topic, _picture(drive.picture(moment.time), stamp, setup.raw, cut=cut))]
        case Sense.SCAN:
            ranges = drive.ranges(moment.time, BEARINGS).astype(float).tolist()
            scan = messages.LaserScan(
                timestamp=stamp, frame_id="laser", start_angle=BEARINGS[0], end_angle=BEARINGS[-1], ranges=ranges
            )
            return [(topic, scan)]
        case Sense.ODOMETRY if setup.odometry:
            pose = drive.odometry(moment.time)
            if setup.tf:
                return [("/tf", transforms_message(stamp, "odom", "base_link", pose))]
            message = messages.Odometry(
                timestamp=stamp, frame_id="odom", body_frame_id="base_link", pose=pose_message(pose)
            )
            return [(topic, message)]
        case Sense.TRUTH if setup.truth:
            message = messages.PoseInFrame(timestamp=stamp, frame_id="map", pose=pose_message(drive.pose(moment.time)))
            return [(topic, message)]
    return []


def _picture(image: np.ndarray[Any, Any], stamp: messages.Timestamp, raw: str | None, *, cut: bool) -> Any:
    if raw is None:
        data = cv2.imencode(".png", image)[1].tobytes()
        data = data[: len(data) // 2] if cut else data
        return messages.CompressedImage(timestamp=stamp, frame_id="camera", data=data, format="png")
    height, width = image.shape
    return messages.RawImage(
        timestamp=stamp, frame_id="camera", width=width, height=height, encoding=raw, step=width, data=image.tobytes()
    )


def transforms_message(stamp: messages.Timestamp, parent: str, child: str, pose: Pose) -> messages.FrameTransforms:
    half = pose.heading / 2
    one = messages.FrameTransform(
        timestamp=stamp,
        parent_frame_id=parent,
        child_frame_id=child,
        translation=messages.Vector3(x=pose.x, y=pose.y, z=0),
        rotation=messages.Quaternion(x=0, y=0, z=math.sin(half), w=math.cos(half)),
    )
    return messages.FrameTransforms(transforms=[one])


def write_json(path: Path, drive: RobotDrive) -> Path:
    """Write the drive as JSON messages, with the mcap library."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        ids: dict[str, int] = {}
        for moment in drive.moments:
            name, message = _json(drive, moment)
            topic = TOPICS[moment.sense]
            if topic not in ids:
                schema = writer.register_schema(f"foxglove.{name}", "jsonschema", b'{"type": "object"}')
                ids[topic] = writer.register_channel(topic, "json", schema)
            writer.add_message(ids[topic], ns(moment.logged), json.dumps(message).encode(), ns(moment.time))
        writer.finish()
    return path


def _json(drive: RobotDrive, moment: Moment) -> tuple[str, dict[str, Any]]:
    nanoseconds = ns(moment.time)
    head = {"timestamp": {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}, "frame_id": "here"}
    match moment.sense:
        case Sense.PICTURE:
            data = cv2.imencode(".png", drive.picture(moment.time))[1].tobytes()
            return "CompressedImage", {**head, "data": base64.b64encode(data).decode(), "format": "png"}
        case Sense.SCAN:
            ranges = drive.ranges(moment.time, BEARINGS).astype(float).tolist()
            ranges = [r if math.isfinite(r) else None for r in ranges]
            return "LaserScan", {**head, "start_angle": BEARINGS[0], "end_angle": BEARINGS[-1], "ranges": ranges}
        case Sense.ODOMETRY:
            return "Odometry", {**head, "body_frame_id": "base_link", "pose": _json_pose(drive.odometry(moment.time))}
        case Sense.TRUTH:
            return "PoseInFrame", {**head, "pose": _json_pose(drive.pose(moment.time))}


def _json_pose(pose: Pose) -> dict[str, Any]:
    half = pose.heading / 2
    return {
        "position": {"x": pose.x, "y": pose.y, "z": 0},
        "orientation": {"x": 0, "y": 0, "z": math.sin(half), "w": math.cos(half)},
    }
