"""Records of an MCAP file one after the other, up to where it is cut off or damaged."""

import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader

from refseq.files import open_input
from refseq.limits import CHUNK_BYTES, MESSAGES, TOPICS, UNPACKED_BYTES, TotalSize
from refseq.logs.decoding.unpacking import WholeReads, translating, unpack_lz4, unpack_zstd

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
    with open_input(path) as file:
        head = file.read(len(MCAP_MAGIC))
    return bool(head) and head == MCAP_MAGIC[: len(head)]


def reason(error: McapError) -> str:
    """The first line of an error that may have none."""
    return next(iter(str(error).splitlines()), "unexpected end of file")


def records(path: Path) -> Iterator[Header | Metadata | Footer | Schema | Channel | McapMessage]:
    """Yield the file's header, metadata and footer, its schemas and channels, and its messages with theirs.

    Raises ``McapError`` where the file is cut off or damaged, and ``LogError`` where it holds more than it may.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    messages = MESSAGES.of(path)
    with WholeReads(path) as file, translating(McapError, McapError):
        for record in _plain_records(file, UNPACKED_BYTES.of(path)):
            match record:
                case Schema():
                    schemas.setdefault(record.id, record)
                    yield record
                case Channel():
                    channels.setdefault(record.id, record)
                    TOPICS.check(len(channels), f"{path}: has")
                    yield record
                case Message():
                    messages.add(1)
                    if record.channel_id not in channels:
                        raise McapError(f"a message of channel {record.channel_id}, which is not declared before it")
                    channel = channels[record.channel_id]
                    yield McapMessage(channel, schemas.get(channel.schema_id), record)
                case Header() | Metadata() | Footer():
                    yield record


def _plain_records(file: WholeReads, unpacked: TotalSize) -> Iterator[object]:
    """Records of the file, those of its chunks in their place."""
    for record in StreamReader(file, validate_crcs=True, emit_chunks=True).records:
        if isinstance(record, Chunk):
            yield from _inside(_unpacked(record, unpacked))
        else:
            yield record


def _unpacked(chunk: Chunk, unpacked: TotalSize) -> bytes:
    """The bytes of a chunk, no more of them than it declares and the file may give."""
    size = chunk.uncompressed_size
    CHUNK_BYTES.check(size, "a chunk declares", McapError)
    unpacked.add(size)
    match chunk.compression:
        case "zstd":
            data = unpack_zstd(chunk.data, size)
        case "lz4":
            data = unpack_lz4(chunk.data, size)
        case "":
            data = chunk.data
        case other:
            raise UnsupportedCompressionError(other[:20])
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise McapError("the checksum of a chunk does not fit it")
    return data


def _inside(data: bytes) -> Iterator[Schema | Channel | Message]:
    """Records of a chunk one by one: all at once, small messages take thirty times the memory of their bytes."""
    stream = ReadDataStream(io.BytesIO(data))
    while stream.count < len(data):
        opcode, length = stream.read1(), stream.read8()
        if length > len(data) - stream.count:
            raise McapError("a record is longer than its chunk")
        end = stream.count + length
        match opcode:
            case Opcode.SCHEMA:
                yield Schema.read(stream)
            case Opcode.CHANNEL:
                yield Channel.read(stream)
            case Opcode.MESSAGE:
                yield Message.read(stream, length)
        if stream.count > end:
            raise McapError("a record is longer than it declares")
        stream.read(end - stream.count)
