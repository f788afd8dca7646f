"""Foxglove's messages, Protobuf or JSON, as contents of samples."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from foxglove import messages
from google.protobuf import json_format  # type: ignore[import-untyped]
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from mcap.exceptions import McapError
from mcap.records import Channel, Schema
from mcap_protobuf.decoder import DecoderFactory

from refseq.logs.picture import CompressedPicture, RawPicture
from refseq.logs.scans import scan_of
from refseq.logs.source import CameraCalibration, Content, GeoFix, Role
from refseq.logs.transforms import Transform, heading_of
from refseq.planar import Pose

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class FoxgloveMessage:
    """A message's own stamp [ns] (0: none), its frame and child frame, and its content."""

    stamp: int
    frame: str
    child: str
    content: Content


def role_of(schema: str, topic: str) -> Role:
    """Use of a channel by the name of its schema."""
    if schema == "foxglove.Log" and topic == "/behaviour":
        return Role.BEHAVIOUR
    return ROLES.get(schema, Role.IGNORED)


ROLES = {
    "foxglove.CompressedImage": Role.CAMERA,
    "foxglove.RawImage": Role.CAMERA,
    "foxglove.CompressedVideo": Role.CAMERA,
    "foxglove.LaserScan": Role.LASER,
    "foxglove.Odometry": Role.ODOMETRY,
    "foxglove.PoseInFrame": Role.TRUTH,
    "foxglove.FrameTransform": Role.TRANSFORMS,
    "foxglove.FrameTransforms": Role.TRANSFORMS,
    "foxglove.CameraCalibration": Role.CALIBRATION,
    "foxglove.LocationFix": Role.GPS,
}
"""Schemas that are read."""


class MessageDecoder:
    """Turns the bytes of a channel's messages into ``FoxgloveMessage``s."""

    def __init__(self) -> None:
        self._protobuf = DecoderFactory()
        self._decoders: dict[int, Callable[[bytes], Any] | None] = {}

    def reads(self, channel: Channel, schema: Schema | None) -> bool:
        """Tell whether messages of this channel can be decoded."""
        return self._decoder(channel, schema) is not None

    def decode(self, channel: Channel, schema: Schema, data: bytes) -> FoxgloveMessage:
        """Decode one message. Raises ``ValueError`` or ``DecodeError`` for bytes that make none."""
        decoder = self._decoder(channel, schema)
        assert decoder is not None, "asked only for channels that it reads"
        return _converted(schema.name, decoder(data))

    def _decoder(self, channel: Channel, schema: Schema | None) -> Callable[[bytes], Any] | None:
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._made(channel, schema)
        return self._decoders[channel.id]

    def _made(self, channel: Channel, schema: Schema | None) -> Callable[[bytes], Any] | None:
        if schema is None or role_of(schema.name, channel.topic) is Role.IGNORED:
            return None
        if channel.message_encoding == "json":
            return _json_decoder(schema.name, self._protobuf)
        try:
            return self._protobuf.decoder_for(channel.message_encoding, schema)
        except (McapError, DecodeError, TypeError, KeyError, ValueError):
            return None  # a schema that is none


def _json_decoder(name: str, factory: DecoderFactory) -> Callable[[bytes], Any]:
    """Decode JSON by way of Foxglove's own Protobuf schema of the same name, which says what each field must be."""
    known = getattr(messages, name.removeprefix("foxglove.")).get_schema()
    # Numbers below zero cannot be those of a file's own schemas.
    schema = Schema(id=-1 - sorted(ROLES).index(name), name=known.name, encoding=known.encoding, data=known.data)
    empty = factory.decoder_for("protobuf", schema)
    assert empty is not None, "the library's own schema"

    def decode(data: bytes) -> Any:
        try:
            return json_format.ParseDict(_as_protobuf(json.loads(data)), empty(b""), ignore_unknown_fields=True)
        except json_format.ParseError as error:
            raise ValueError(str(error).splitlines()[0]) from error

    return decode


def _as_protobuf(value: Any) -> Any:
    """Foxglove's JSON in Protobuf's: times are strings there, and no number (null) is NaN."""
    match value:
        case {"sec": int() as seconds, "nsec": int() as nanoseconds}:
            whole = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
            return f"{whole}.{nanoseconds:09d}Z"
        case dict():
            return {key: _as_protobuf(inner) for key, inner in value.items() if inner is not None}
        case list():
            return ["NaN" if inner is None else _as_protobuf(inner) for inner in value]
    return value


def _converted(schema: str, message: Any) -> FoxgloveMessage:
    match schema:
        case "foxglove.CompressedImage" | "foxglove.CompressedVideo":
            return _stamped(message, CompressedPicture(message.data, message.format))
        case "foxglove.RawImage":
            size = message.width, message.height, message.step
            return _stamped(message, RawPicture(message.data, message.encoding, *size))
        case "foxglove.LaserScan":
            return _stamped(message, _scan(message))
        case "foxglove.Odometry":
            return _stamped(message, _pose(message.pose), message.body_frame_id)
        case "foxglove.PoseInFrame":
            return _stamped(message, _pose(message.pose))
        case "foxglove.FrameTransform":
            return FoxgloveMessage(_stamp(message), message.parent_frame_id, "", (_transform(message),))
        case "foxglove.FrameTransforms":
            return _transforms(message)
        case "foxglove.CameraCalibration":
            model = CameraCalibration(
                message.width, message.height, message.distortion_model, tuple(message.D), tuple(message.K)
            )
            return _stamped(message, model)
        case "foxglove.LocationFix":
            return _stamped(message, GeoFix(message.latitude, message.longitude, message.altitude))
        case "foxglove.Log":
            return FoxgloveMessage(_stamp(message), "", "", message.message)
    raise AssertionError(f"{schema} has a role and no content")


def _stamp(message: Any) -> int:
    """A message's stamp [ns]."""
    return int(message.timestamp.seconds) * NANOSECONDS + int(message.timestamp.nanos)


def _stamped(message: Any, content: Content, child: str = "") -> FoxgloveMessage:
    return FoxgloveMessage(_stamp(message), message.frame_id, child, content)


def _scan(message: Any) -> Any:
    count = len(message.ranges)
    step = (message.end_angle - message.start_angle) / max(1, count - 1)
    return scan_of(message.ranges, float(message.start_angle), float(step) or 1.0)


def _pose(pose: Any) -> Pose:
    rotation = pose.orientation
    return Pose(pose.position.x, pose.position.y, heading_of((rotation.x, rotation.y, rotation.z, rotation.w)))


def _transform(message: Any) -> Transform:
    at, turn = message.translation, message.rotation
    rotation = (turn.x, turn.y, turn.z, turn.w)
    return Transform(
        message.parent_frame_id.removeprefix("/"),
        message.child_frame_id.removeprefix("/"),
        (at.x, at.y, at.z),
        rotation if any(rotation) else (0.0, 0.0, 0.0, 1.0),
    )


def _transforms(message: Any) -> FoxgloveMessage:
    stamps = [_stamp(one) for one in message.transforms]
    return FoxgloveMessage(max(stamps, default=0), "", "", tuple(_all(message.transforms)))


def _all(transforms: Any) -> Iterator[Transform]:
    for one in transforms:
        yield _transform(one)
