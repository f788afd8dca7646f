"""Messages on a robot's channels as samples: Foxglove's in Protobuf and JSON, ROS 2's in CDR."""

from collections.abc import Callable
from dataclasses import dataclass

from foxglove import messages
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from mcap.exceptions import McapError
from mcap.records import Channel, Schema

from refseq.errors import LogError
from refseq.logs.foxglove.messages import NANOSECONDS, ROLES, MessageDecoder, role_of
from refseq.logs.ros.contents import ROS_TYPES
from refseq.logs.ros.decoder import RosDecoder, Serialization
from refseq.logs.source import Role, Sample
from refseq.serve.protocol import ClientChannel, FoxgloveProtocolError

ENCODINGS = ("protobuf", "json", "cdr")
"""Encodings that are read: Foxglove's two, and that of ROS 2."""
VIDEO = "foxglove.CompressedVideo"
"""Pictures that cannot be decoded alone."""


@dataclass(frozen=True, slots=True)
class RobotChannel:
    """A channel that is read: the topic, its role, and what makes a sample of a message that came at a time [ns].

    ``read`` raises ``FoxgloveProtocolError`` for bytes that are no such message, and gives None for one that tells
    nothing.
    """

    topic: str
    role: Role
    read: Callable[[bytes, int], Sample | None]


def robot_channel(told: ClientChannel) -> RobotChannel:
    """The reader of a channel. Raises ``FoxgloveProtocolError`` for messages that are not read."""
    if told.encoding == "cdr":
        role = role_of_ros(told)
        if role is not Role.IGNORED:
            return RobotChannel(told.topic, role, _ros(told))
    elif told.encoding in ENCODINGS and told.schema_name in ROLES and told.schema_name != VIDEO:
        return RobotChannel(told.topic, role_of(told.schema_name, told.topic), _foxglove(told))
    raise FoxgloveProtocolError(
        f"topic {told.topic}: {told.schema_name} in {told.encoding} is passed over; valid are "
        f"{', '.join(sorted(set(ROLES) - {VIDEO}))} in protobuf or json, and {', '.join(sorted(ROS_TYPES))} in cdr"
    )


def role_of_ros(told: ClientChannel) -> Role:
    """Use of a channel of ROS messages."""
    return RosDecoder(Serialization.CDR).role(told.topic, told.schema_name)


def _ros(told: ClientChannel) -> Callable[[bytes, int], Sample | None]:
    decoder = RosDecoder(Serialization.CDR)

    def read(data: bytes, now: int) -> Sample | None:
        try:
            return decoder.sample(told.topic, told.schema_name, now, data)
        except LogError as error:
            raise FoxgloveProtocolError(str(error)) from error

    return read


def _foxglove(told: ClientChannel) -> Callable[[bytes, int], Sample | None]:
    decoder = MessageDecoder()
    # A schema of our own, not the one that is sent: nothing from outside is compiled.
    known = getattr(messages, told.schema_name.removeprefix("foxglove.")).get_schema()
    schema = Schema(id=1, name=known.name, encoding=known.encoding, data=known.data)
    channel = Channel(id=1, topic=told.topic, message_encoding=told.encoding, metadata={}, schema_id=1)
    if not decoder.reads(channel, schema):
        raise FoxgloveProtocolError(f"topic {told.topic}: {told.schema_name} in {told.encoding} cannot be read")

    def read(data: bytes, now: int) -> Sample | None:
        try:
            message = decoder.decode(channel, schema, data)
        except (ValueError, TypeError, AttributeError, OverflowError, RecursionError, DecodeError, McapError) as error:
            reason = (str(error) or type(error).__name__).splitlines()[0]
            raise FoxgloveProtocolError(f"topic {told.topic}: is no {told.schema_name}: {reason:.200}") from error
        except LogError as error:
            raise FoxgloveProtocolError(f"topic {told.topic}: {error}") from error
        return Sample(
            told.topic,
            (message.stamp or now) / NANOSECONDS,
            now / NANOSECONDS,
            message.frame.removeprefix("/"),
            message.content,
            message.child.removeprefix("/"),
            unstamped=not message.stamp,
        )

    return read
