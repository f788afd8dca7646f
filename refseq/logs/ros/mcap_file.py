"""MCAP files of ROS messages as streams of serialised messages."""

from collections.abc import Collection, Iterator
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel, Header, Schema
from rosbags.typesys.msg import normalize_msgtype

from refseq.limits import UNPACKED_BYTES
from refseq.logs.decoding.unpacking import translating
from refseq.logs.foxglove.index import index_of
from refseq.logs.foxglove.records import McapMessage, is_mcap, records
from refseq.logs.ros.storage import BagTopic, DamagedBagError, StoredMessage, unpacked_message

ROS_PROFILES = ("ros1", "ros2")
ROS_ENCODINGS = ("cdr", "ros1")
METADATA_RECORD, METADATA_KEY = "rosbag2", "serialized_metadata"
"""Name of the record, and of its entry, that holds the bag's ``metadata.yaml`` within the file."""


def holds_ros(path: Path) -> bool:
    """Tell whether a file is an MCAP file of ROS by its profile, or, where it names none, by its first channel."""
    if not is_mcap(path):
        return False
    try:
        for record in records(path):
            if isinstance(record, Header) and record.profile:
                return record.profile in ROS_PROFILES
            if isinstance(record, Channel):
                return record.message_encoding in ROS_ENCODINGS
    except McapError:
        pass
    return False


class McapRosFile:
    """One ``.mcap`` file of ROS messages; one that was cut off is read up to there."""

    def __init__(self, path: Path, told: Path | None = None) -> None:
        """Open a file; messages name it ``told``, where the user's own is a packed one."""
        self.path, self.told = path, told or path
        with translating(lambda reason: DamagedBagError(self.told, reason)):
            index = index_of(path)
        if index.damage and not index.counts:
            raise DamagedBagError(self.told, index.damage)
        self.damage = index.damage
        self.topics = tuple(
            _topic(channel, index.schema_of(channel), index.counts[channel.id]) for channel in index.channels.values()
        )
        kept = (record.metadata.get(METADATA_KEY, "") for record in index.metadata if record.name == METADATA_RECORD)
        self.metadata_text = next(kept, "")

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in the order of the file."""
        unpacked = UNPACKED_BYTES.of(self.path)
        with translating(lambda reason: DamagedBagError(self.told, reason)):
            for record in records(self.path):
                if isinstance(record, McapMessage) and record.channel.topic in topics and record.schema is not None:
                    kind, data = normalize_msgtype(record.schema.name), unpacked_message(record.message.data)
                    unpacked.add(len(data))
                    yield StoredMessage(record.channel.topic, kind, record.message.log_time, data)


def _topic(channel: Channel, schema: Schema | None, count: int) -> BagTopic:
    kind = normalize_msgtype(schema.name) if schema is not None else channel.message_encoding
    return BagTopic(channel.topic, kind, channel.message_encoding, count)
