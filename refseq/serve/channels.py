"""Messages on a robot's channels as samples: Foxglove's in Protobuf and JSON, ROS 2's in CDR."""

from collections.abc import Callable
from dataclasses import dataclass

from mcap.records import Channel, Schema

from refseq.errors import LogError
from refseq.logs.foxglove.messages import ROLES, MessageDecoder, role_of
from refseq.logs.ros.contents import ROS_TYPES
from refseq.logs.ros.decoder import RosDecoder, Serialization
from refseq.logs.source import NANOSECONDS, Role, Sample, seconds_of
from refseq.serve.protocol import ClientChannel, FoxgloveProtocolError
from refseq.view import Scan

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
    schema = Schema(id=1, name=told.schema_name, encoding="protobuf", data=b"")  # the decoder has its own
    channel = Channel(id=1, topic=told.topic, message_encoding=told.encoding, metadata={}, schema_id=1)
    if not decoder.reads(channel, schema):
        raise FoxgloveProtocolError(f"topic {told.topic}: {told.schema_name} in {told.encoding} cannot be read")

    def read(data: bytes, now: int) -> Sample | None:
        try:
            message = decoder.decode(channel, schema, data)
            if message is None:
                return None
            # Whoever has no clock can leave the stamp out here; a log of theirs cannot be written anew.
            time = seconds_of(now if message.stamp is None else message.stamp)
        except LogError as error:
            raise FoxgloveProtocolError(f"topic {told.topic}: is no {told.schema_name}: {error}") from error
        if isinstance(message.content, Scan) and not len(message.content.ranges):  # in JSON: a field that is misspelt
            raise FoxgloveProtocolError(f"topic {told.topic}: a scan has no ranges; valid is a list of them [m]")
        return Sample(
            told.topic,
            time,
            now / NANOSECONDS,
            message.frame.removeprefix("/"),
            message.content,
            message.child.removeprefix("/"),
            unstamped=message.stamp is None,
        )

    return read
