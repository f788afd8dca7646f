"""MCAP files with Foxglove's schemas as a source of samples."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Footer

from refseq.errors import LogError
from refseq.logs.closing import CuttableLog
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.decoding.video import VideoStream
from refseq.logs.foxglove.index import McapIndex, index_of
from refseq.logs.foxglove.messages import MessageDecoder, role_of
from refseq.logs.foxglove.records import McapMessage, reason, records
from refseq.logs.foxglove.writer import METADATA_NAME, PROFILE
from refseq.logs.source import EMPTY, NANOSECONDS, Channel, Content, Role, Sample, seconds_of
from refseq.logs.unreadable import Unreadable, UnreadableMessageError, UnreadableTally


class FoxgloveSource(CuttableLog):
    """An MCAP file; channels whose schema is not Foxglove's are listed and not read."""

    kind = "a Foxglove MCAP file"

    def __init__(self, path: Path) -> None:
        self.path = path
        self._decoder = MessageDecoder()
        self._index = index_of(path)
        self._cut = self._index.damage
        self._empty: Counter[str] = Counter()  # messages that told nothing when they were last read, by topic
        self._tally = UnreadableTally()
        # Of a topic's channels the one that is read is the last, so that it is the one of tables by topic.
        found = _channels(self._index, self._decoder)
        self.channels = tuple(sorted(found, key=lambda one: (one.topic, one.role is not Role.IGNORED)))

    @property
    def _schemas(self) -> Mapping[str, str]:
        """Schema of each topic that is read; of a topic's channels that of the last."""
        return {channel.topic: channel.schema for channel in self.channels if channel.role is not Role.IGNORED}

    @property
    def metadata(self) -> Mapping[str, str]:
        """The bench's own records; of two values of a key the later one counts."""
        told: dict[str, str] = {}
        for record in self._index.metadata:
            if record.name == METADATA_NAME:
                told.update(record.metadata)
        return told

    @property
    def skipped(self) -> Mapping[str, int]:
        """Messages that are not read, by schema, or by encoding where there is none."""
        found: Counter[str] = Counter()
        for channel in self.channels:
            if channel.role is Role.IGNORED:
                found[channel.schema] += channel.count
        for topic, schema in self._schemas.items():
            found[f"{schema}{EMPTY}"] += self._empty[topic]
        return {schema: count for schema, count in found.items() if count}

    @property
    def unreadable(self) -> Mapping[str, Unreadable]:
        """Messages that are not what their schema says, by topic."""
        return self._tally.found

    @property
    def has_moments(self) -> bool:
        """True for the bench's own recordings, by the profile in the file's head."""
        return self._index.profile == PROFILE

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Samples of the topics asked for; messages that are none are left out, and ``unreadable``."""
        wanted = {topic: schema for topic, schema in self._schemas.items() if topics is None or topic in topics}
        self._tally.begin(wanted)
        for topic in wanted:
            self._empty.pop(topic, None)
        whole = False
        videos: dict[str, VideoStream] = {}
        try:
            for record in records(self.path):
                if isinstance(record, McapMessage) and _is_wanted(record, wanted):
                    sample = self._sample(record, videos)
                    if sample is not None:
                        yield sample
                whole = whole or isinstance(record, Footer)
        except McapError as error:
            self._cut = reason(error)
        else:
            self._cut = "" if whole else "unexpected end of file"

    def _sample(self, record: McapMessage, videos: dict[str, VideoStream]) -> Sample | None:
        channel, schema = record.channel, record.schema
        if schema is None or not self._decoder.reads(channel, schema):
            return None
        logged = record.message.log_time
        self._tally.see(channel.topic)
        try:
            message = self._decoder.decode(channel, schema, record.message.data)
            if message is None:
                self._empty[channel.topic] += 1
                return None
            content: Content | None = message.content
            if schema.name == "foxglove.CompressedVideo" and isinstance(content, CompressedPicture):
                content = videos.setdefault(channel.topic, VideoStream()).picture(content.data, content.encoding)
            times = seconds_of(message.stamp or logged), seconds_of(logged)
        except LogError as error:
            valid = f"{schema.name} as {channel.message_encoding}"
            self._tally.lose(UnreadableMessageError(channel.topic, logged / NANOSECONDS, str(error), valid))
            return None
        if content is None:  # nothing can be seen before the first key frame
            self._empty[channel.topic] += 1
            return None
        return Sample(
            channel.topic,
            *times,
            message.frame.removeprefix("/"),
            content,
            message.child.removeprefix("/"),
            unstamped=not message.stamp,
            moment=logged if self.has_moments else -1,
        )


def _is_wanted(record: McapMessage, wanted: Mapping[str, str]) -> bool:
    """Tell whether a message is of a topic, and of the schema that is read of it."""
    return record.schema is not None and wanted.get(record.channel.topic) == record.schema.name


def _channels(index: McapIndex, decoder: MessageDecoder) -> Iterator[Channel]:
    """One for each channel; of two schemas on a topic that are read, the one with more messages is."""
    taken: dict[str, str] = {}
    for channel in sorted(index.channels.values(), key=lambda one: -index.counts[one.id]):
        schema = index.schema_of(channel)
        name = schema.name if schema else channel.message_encoding
        role = role_of(name, channel.topic) if decoder.reads(channel, schema) else Role.IGNORED
        if role is not Role.IGNORED and taken.setdefault(channel.topic, name) != name:
            role = Role.IGNORED
        yield Channel(channel.topic, name, channel.message_encoding, index.counts[channel.id], role)
