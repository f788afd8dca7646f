"""Decoder of serialised ROS messages into samples.

Nothing that a bag says is executed. ``rosbags`` makes Python source from message definitions and runs it, with names as
the definition has them; so definitions that bags carry are never given to it. Messages are read by the definitions that
come with ``rosbags`` and the few below, which covers all types that the bench has a use for: they have not changed on
the wire from ROS 2 Foxy on. ROS 1 names a definition by its checksum, and a type whose checksum is another is passed
over.
"""

from enum import StrEnum
from functools import cached_property, lru_cache

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from refseq.errors import LogError
from refseq.limits import MESSAGE_BYTES
from refseq.logs.decoding.unpacking import translating
from refseq.logs.ros.contents import ROS_TYPES, role_of
from refseq.logs.source import NANOSECONDS, Role, Sample, seconds_of
from refseq.logs.unreadable import UnreadableMessageError


class Serialization(StrEnum):
    """Encoding of a message in bytes: ROS 2's Common Data Representation, or ROS 1's own way."""

    CDR = "cdr"
    ROS1 = "ros1"


@lru_cache
def known_types(serialization: Serialization) -> Typestore:
    """The message definitions that messages are read by."""
    if serialization is Serialization.CDR:
        return get_typestore(Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    return store


class RosDecoder:
    """Turns serialised messages of known types into samples."""

    def __init__(self, serialization: Serialization) -> None:
        self.serialization = serialization

    @cached_property
    def _types(self) -> Typestore:
        return known_types(self.serialization)

    def role(self, topic: str, type_name: str, digest: str = "") -> Role:
        """Use of a topic; a type that ROS 1 tells by another checksum than ours is ``IGNORED``."""
        role = role_of(type_name, topic)
        if role is Role.IGNORED or self.serialization is Serialization.CDR or digest in ("", "*"):
            return role
        return role if self._types.generate_msgdef(type_name)[1] == digest else Role.IGNORED

    def sample(self, topic: str, type_name: str, logged: int, data: bytes) -> Sample | None:
        """The message that was ``logged`` [ns] on a topic; None for one that tells nothing.

        Raises ``UnreadableMessageError`` for bytes that are no such message.
        """
        known = ROS_TYPES[type_name]
        try:
            if known.role is not Role.CAMERA:
                MESSAGE_BYTES.check(len(data), "it has")
            with translating(LogError):
                found = known.content_of(self._message(type_name, data), topic)
            times = seconds_of(found.stamp or logged), seconds_of(logged)
        except LogError as error:
            raise UnreadableMessageError(topic, logged / NANOSECONDS, str(error), type_name) from error
        if found.content is None:
            return None
        frame, child = found.frame.lstrip("/"), found.child.lstrip("/")
        return Sample(topic, *times, frame, found.content, child, unstamped=found.stamp == 0)

    def _message(self, type_name: str, data: bytes) -> object:
        if self.serialization is Serialization.CDR:
            return self._types.deserialize_cdr(data, type_name)
        return self._types.deserialize_ros1(data, type_name)
