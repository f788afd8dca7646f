"""Foxglove's messages, Protobuf or JSON, as contents of samples."""

import json
import math
from collections.abc import Callable
from dataclasses import astuple, dataclass
from datetime import UTC, datetime
from typing import Any

from foxglove import messages
from google.protobuf import json_format  # type: ignore[import-untyped]
from mcap.exceptions import McapError
from mcap.records import Channel, Schema
from mcap_protobuf.decoder import DecoderFactory

from refseq.errors import LogError
from refseq.limits import FRAMES, JSON_BYTES, MESSAGE_BYTES
from refseq.logs.decoding.picture import CompressedPicture, RawPicture
from refseq.logs.decoding.unpacking import translating
from refseq.logs.scans import scan_of
from refseq.logs.source import NANOSECONDS, CameraCalibration, Content, GeoFix, Role
from refseq.logs.transforms import Transform, pose_of_message


@dataclass(frozen=True, slots=True)
class FoxgloveMessage:
    """A message's own stamp [ns], its frame and child frame, and its content.

    ``stamp`` None: it has none. Zero is where simulated clocks begin, and what programs without a clock write.
    """

    stamp: int | None
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
NAMES = (*ROLES, "foxglove.Log")


class MessageDecoder:
    """Turns the bytes of a channel's messages into ``FoxgloveMessage``s.

    All are decoded by Foxglove's own schema of the name that the channel's schema has, whatever the file puts in its
    place: a schema is a program for a decoder, and Foxglove only ever adds fields to its own.
    """

    def __init__(self) -> None:
        self._protobuf = DecoderFactory()
        self._decoders: dict[int, Callable[[bytes], Any] | None] = {}

    def reads(self, channel: Channel, schema: Schema | None) -> bool:
        """Tell whether messages of this channel can be decoded."""
        return self._decoder(channel, schema) is not None

    def decode(self, channel: Channel, schema: Schema, data: bytes) -> FoxgloveMessage | None:
        """Decode one message; None of one that tells nothing.

        Raises ``McapError`` for bytes that make none, and ``LogError`` for values that are not valid.
        """
        decoder = self._decoder(channel, schema)
        assert decoder is not None, "asked only for channels that it reads"
        if role_of(schema.name, channel.topic) is not Role.CAMERA:
            MESSAGE_BYTES.check(len(data), "a message has")
        with translating(lambda reason: McapError(f"bytes that make no record: {reason}")):
            return _converted(schema.name, decoder(data))

    def _decoder(self, channel: Channel, schema: Schema | None) -> Callable[[bytes], Any] | None:
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._made(channel, schema)
        return self._decoders[channel.id]

    def _made(self, channel: Channel, schema: Schema | None) -> Callable[[bytes], Any] | None:
        if schema is None or role_of(schema.name, channel.topic) is Role.IGNORED:
            return None
        match channel.message_encoding, schema.encoding:
            case "json", _:
                return _from_json(self._own(schema.name))
            case "protobuf", "protobuf":
                return self._own(schema.name)
        return None

    def _own(self, name: str) -> Callable[[bytes], Any]:
        """Foxglove's own decoder of Protobuf messages."""
        known = getattr(messages, name.removeprefix("foxglove.")).get_schema()
        schema = Schema(id=NAMES.index(name), name=known.name, encoding=known.encoding, data=known.data)
        decoder: Callable[[bytes], Any] | None = self._protobuf.decoder_for("protobuf", schema)
        assert decoder is not None, "the library's own schema"
        return decoder


def _from_json(own: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Decode JSON by way of the Protobuf schema of the same name, which says what each field must be."""

    def decode(data: bytes) -> Any:
        JSON_BYTES.check(len(data), "a message has")
        # Python's own writer has Infinity and NaN without quotes: as text they are Protobuf's.
        told = json.loads(data, parse_constant=str)
        return json_format.ParseDict(_as_protobuf(told), own(b""), ignore_unknown_fields=True)

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


def _converted(schema: str, message: Any) -> FoxgloveMessage | None:
    match schema:
        case "foxglove.CompressedImage" | "foxglove.CompressedVideo":
            return _stamped(message, CompressedPicture(message.data, message.format))
        case "foxglove.RawImage":
            size = message.width, message.height, message.step
            return _stamped(message, RawPicture(message.data, message.encoding, *size))
        case "foxglove.LaserScan":
            return _stamped(message, _scan(message))
        case "foxglove.Odometry":
            return _stamped(message, pose_of_message(message.pose), message.body_frame_id)
        case "foxglove.PoseInFrame":
            return _stamped(message, pose_of_message(message.pose))
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
            fix = GeoFix(message.latitude, message.longitude, message.altitude)
            return _stamped(message, fix if all(map(math.isfinite, astuple(fix))) else None)
        case "foxglove.Log":
            return FoxgloveMessage(_stamp(message), "", "", message.message)
    raise AssertionError(f"{schema} has a role and no content")


def _stamp(message: Any) -> int | None:
    """A message's stamp [ns], None where it is left out."""
    if not message.HasField("timestamp"):
        return None
    return int(message.timestamp.seconds) * NANOSECONDS + int(message.timestamp.nanos)


def _stamped(message: Any, content: Content | None, child: str = "") -> FoxgloveMessage | None:
    return None if content is None else FoxgloveMessage(_stamp(message), message.frame_id, child, content)


def _scan(message: Any) -> Any:
    count = len(message.ranges)
    if count > 1 and message.start_angle == message.end_angle:
        raise LogError(
            f"a scan of {count} beams starts and ends at {message.start_angle:g} rad; valid are a start_angle and an "
            "end_angle of the first and the last beam [rad], which left out are 0"
        )
    step = (message.end_angle - message.start_angle) / max(1, count - 1)
    return scan_of(message.ranges, float(message.start_angle), float(step) or 1.0)


def _transform(message: Any) -> Transform:
    at, turn = message.translation, message.rotation
    rotation = (turn.x, turn.y, turn.z, turn.w)
    return Transform(
        message.parent_frame_id.removeprefix("/"),
        message.child_frame_id.removeprefix("/"),
        (at.x, at.y, at.z),
        rotation if any(rotation) else (0.0, 0.0, 0.0, 1.0),
    )


def _transforms(message: Any) -> FoxgloveMessage | None:
    FRAMES.check(len(message.transforms), "a message has")
    if not message.transforms:
        return None
    stamps = [stamp for one in message.transforms if (stamp := _stamp(one)) is not None]
    return FoxgloveMessage(max(stamps, default=None), "", "", tuple(map(_transform, message.transforms)))
