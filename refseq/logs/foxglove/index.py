"""Channels, counts and metadata of an MCAP file: from its summary, or by a pass over it where that is damaged."""

import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Footer, Header, Metadata, Schema

from refseq.files import open_input
from refseq.limits import TOPICS
from refseq.logs.decoding.unpacking import WholeReads, translating
from refseq.logs.foxglove.records import MCAP_MAGIC, McapMessage, reason, records

FOOTER = 1 + 8 + 8 + 8 + 4
"""Bytes of the footer's record: opcode, length, two offsets, checksum."""
MOST_SUMMARY = 1 << 28
"""The longest summary that is believed [bytes]."""
MOST_METADATA = 1000
"""The most records of metadata that a summary may point to; many could point to one."""


@dataclass(slots=True)
class McapIndex:
    """Contents of a file: its profile, channels with their schemas and counts, and metadata records by name.

    ``damage`` says where a pass ended, empty where the file is whole.
    """

    profile: str = ""
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    counts: Counter[int] = field(default_factory=Counter)
    metadata: list[Metadata] = field(default_factory=list)
    damage: str = ""

    def schema_of(self, channel: Channel) -> Schema | None:
        """A channel's schema; None where it has none."""
        return self.schemas.get(channel.schema_id)


def index_of(path: Path) -> McapIndex:
    """The contents of a file. A file without a sound summary is passed over once."""
    try:
        with translating(McapError, McapError):
            found = _by_summary(path) if summary_is_sound(path) else None
    except McapError:
        found = None
    found = found or _by_pass(path)
    TOPICS.check(len(found.channels), f"{path}: has")
    return found


def summary_is_sound(path: Path) -> bool:
    """Tell whether the file ends with a footer whose checksum fits the summary."""
    size = path.stat().st_size
    tail = FOOTER + len(MCAP_MAGIC)
    if size < 2 * tail:
        return False
    with open_input(path) as file:
        file.seek(size - tail)
        footer = file.read(tail)
        start, _, checksum = struct.unpack("<QQI", footer[9:FOOTER])
        if footer[FOOTER:] != MCAP_MAGIC or not checksum or not 0 < start < size - tail:
            return False
        length = size - tail - start
        if length > MOST_SUMMARY:
            return False
        file.seek(start)
        return bool(zlib.crc32(file.read(length + FOOTER - 4)) == checksum)


def _by_summary(path: Path) -> McapIndex | None:
    with WholeReads(path) as file:
        reader = SeekingReader(file, validate_crcs=True)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None or len(summary.metadata_indexes) > MOST_METADATA:
            return None
        return McapIndex(
            reader.get_header().profile,
            dict(summary.channels),
            dict(summary.schemas),
            Counter(summary.statistics.channel_message_counts),
            list(reader.iter_metadata()),
        )


def _by_pass(path: Path) -> McapIndex:
    # Behind the messages the file repeats its schemas and channels; the first ones are those that messages go by.
    found = McapIndex(damage="unexpected end of file")
    try:
        for record in records(path):
            match record:
                case Header():
                    found.profile = record.profile
                case Schema():
                    found.schemas.setdefault(record.id, record)
                case Channel():
                    found.channels.setdefault(record.id, record)
                case McapMessage():
                    found.counts[record.channel.id] += 1
                case Metadata():
                    found.metadata.append(record)
                case Footer():
                    found.damage = ""
    except McapError as error:
        found.damage = reason(error)
    return found
