"""Records of an MCAP file one after the other, up to where it is cut off or damaged."""

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Footer, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader

MCAP_MAGIC = b"\x89MCAP0\r\n"


@dataclass(frozen=True, slots=True)
class McapMessage:
    """A message with its channel and schema; ``schema`` is None where the channel has none."""

    channel: Channel
    schema: Schema | None
    message: Message


def is_mcap(path: Path) -> bool:
    """Tell whether a file begins as an MCAP file does; one of less than eight bytes may be cut off."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(len(MCAP_MAGIC))
    return bool(head) and head == MCAP_MAGIC[: len(head)]


def reason(error: McapError) -> str:
    """The first line of an error that may have none."""
    return next(iter(str(error).splitlines()), "unexpected end of file")


class _WholeReads(io.BufferedReader):
    """A file that ends with ``EndOfFile`` inside a record; MCAP's reader would take the rest for the whole."""

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self._left = path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        """Exactly ``size`` bytes."""
        count = self._left if size is None or size < 0 else size
        # Asked before reading, for a damaged length may be larger than the memory.
        if count > self._left:
            raise EndOfFile
        self._left -= count
        return super().read(count)


def records(path: Path) -> Iterator[Header | Metadata | Footer | Schema | Channel | McapMessage]:
    """Yield the file's header, metadata and footer, its schemas and channels, and its messages with theirs.

    Raises ``McapError`` where the file is cut off or damaged, and where a consumer decodes bytes that make no message.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    with _WholeReads(path) as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                match record:
                    case Schema():
                        schemas.setdefault(record.id, record)
                        yield record
                    case Channel():
                        channels.setdefault(record.id, record)
                        yield record
                    case Message():
                        channel = channels[record.channel_id]
                        yield McapMessage(channel, schemas.get(channel.schema_id), record)
                    case Header() | Metadata() | Footer():
                        yield record
        except (struct.error, ValueError, KeyError, TypeError, DecodeError) as error:
            # What the library raises for bytes that make no record.
            raise McapError(f"bytes that make no record: {error}") from error
