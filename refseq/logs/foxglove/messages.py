"""Foxglove's messages, Protobuf or JSON, as contents of samples."""

import math
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any

from foxglove import messages
from mcap.records import Channel, Schema
from mcap_protobuf.decoder import DecoderFactory

from refseq.errors import LogError
from refseq.limits import FRAMES, MESSAGE_BYTES
from refseq.logs.decoding.picture import CompressedPicture, RawPicture
from refseq.logs.decoding.unpacking import translating
from refseq.logs.foxglove.json_messages import from_json
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

        Raises ``LogError`` for bytes that make none, and for values that are not valid.
        """
        decoder = self._decoder(channel, schema)
        assert decoder is not None, "asked only for channels that it reads"
        if role_of(schema.name, channel.topic) is not Role.CAMERA:
            MESSAGE_BYTES.check(len(data), "a message has")
        with translating(LogError):
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
                return from_json(self._own(schema.name))
            case "protobuf", "protobuf":
                return _from_protobuf(self._own(schema.name))
        return None

    def _own(self, name: str) -> Callable[[bytes], Any]:
        """Foxglove's own decoder of Protobuf messages."""
        known = getattr(messages, name.removeprefix("foxglove.")).get_schema()
        schema = Schema(id=NAMES.index(name), name=known.name, encoding=known.encoding, data=known.data)
        decoder: Callable[[bytes], Any] | None = self._protobuf.decoder_for("protobuf", schema)
        assert decoder is not None, "the library's own schema"
        return decoder


def _from_protobuf(own: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Decode Protobuf, whose library has its own words for what is none."""

    def decode(data: bytes) -> Any:
        other = ", but look like JSON" if data[:1] in (b"{", b"[") else ""
        with translating(lambda _: LogError(f"its bytes are no Protobuf{other}")):
            return own(data)

    return decode


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
    if count > 1 and message.start_angle == message.end_angle:  # 0 and 0, where a writer has left them out
        raise LogError(
            f"its start_angle and its end_angle are {message.start_angle:g}; valid are the bearings of the first beam "
            "and of the last [rad]"
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
