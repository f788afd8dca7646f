"""Files of bags as streams of serialised messages: SQLite and ROS 1 through ``rosbags``, each opened by its content."""

import bz2
import struct
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol
from urllib.parse import quote

import apsw
import lz4.frame  # type: ignore[import-untyped]
import zstandard
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag1 import Reader as Rosbag1Reader
from rosbags.rosbag1 import ReaderError as Rosbag1Error
from rosbags.rosbag1.reader import Chunk
from rosbags.rosbag2 import ReaderError as Rosbag2Error
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from refseq.errors import LogError

MOST_BYTES = 1 << 29
"""The most that one chunk or message may unpack to [bytes]; what unpacks to more is damaged, or made to fill memory."""

SQLITE_MAGIC = b"SQLite format 3\0"
ROSBAG1_MAGIC = b"#ROSBAG V"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


class StoredMessage(NamedTuple):
    """A message as it was logged, at ``logged`` [ns]."""

    topic: str
    type: str
    logged: int
    data: bytes


@dataclass(frozen=True, slots=True)
class BagTopic:
    """A topic of one file: its type, how messages became bytes, how many there are, the definition's checksum."""

    topic: str
    type: str
    serialization: str
    count: int
    digest: str = ""


class BagFile(Protocol):
    """A file of a bag that can be read."""

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All that it holds."""
        ...

    @property
    def damage(self) -> str:
        """The reason why a file was seen to be cut off when it was opened; else empty."""
        ...

    @property
    def metadata_text(self) -> str:
        """The text of a rosbag2's metadata, where the file holds it; else empty."""
        ...

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in order of logging. Raises ``DamagedBagError`` where the file is cut off."""
        ...


class DamagedBagError(LogError):
    """A bag is cut off or damaged; ``reason`` without its name."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: is cut off or damaged: {reason}; valid is a whole bag")
        self.reason = reason


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    """Raise what the libraries raise for a file that is no bag, or no longer one, as ``DamagedBagError``."""
    try:
        yield
    except (
        *(Rosbag1Error, Rosbag2Error, apsw.Error, zstandard.ZstdError, RuntimeError, AssertionError),
        *(struct.error, ValueError, TypeError, LookupError, OSError, EOFError),
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DamagedBagError(path, reason) from error


class SqliteBag:
    """One ``.db3`` file of a rosbag2, with a ``metadata.yaml`` beside it or without."""

    damage = ""
    metadata_text = ""

    def __init__(self, path: Path, told: Path | None = None) -> None:
        """Open a file; messages name it ``told``, where the user's own is a packed one."""
        self.path, self.told = path, told or path
        with _damage_told(self.told), self._opened() as reader:
            self.topics = tuple(map(_bag_topic, reader.connections))

    @contextmanager
    def _opened(self) -> Iterator[Sqlite3Reader]:
        reader = Sqlite3Reader(_UriPath(self.path))
        reader.open()
        try:
            yield reader
        finally:
            reader.close()

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in order of logging; unpacked where each was compressed."""
        with _damage_told(self.told), self._opened() as reader:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            for connection, logged, data in reader.messages(wanted):
                yield StoredMessage(connection.topic, connection.msgtype, logged, unpacked_message(data))


class _UriPath(type(Path())):  # type: ignore[misc]
    """A path that reads as part of a URI, which ``rosbags`` opens SQLite by: a ``?`` in it would end the path."""

    def __str__(self) -> str:
        return quote(super().__str__())


class Rosbag1File:
    """One ROS 1 ``.bag`` file."""

    damage = ""
    metadata_text = ""

    def __init__(self, path: Path, told: Path | None = None) -> None:
        """Open a file; messages name it ``told``, where the user's own is a packed one."""
        self.path, self.told = path, told or path
        with _damage_told(self.told), _Rosbag1Reader(path) as reader:
            self.topics = tuple(map(_bag_topic, reader.connections))

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in order of logging."""
        with _damage_told(self.told), _Rosbag1Reader(self.path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            for connection, logged, data in reader.messages(wanted) if wanted else ():
                yield StoredMessage(connection.topic, connection.msgtype, logged, data)


class _Rosbag1Reader(Rosbag1Reader):
    """``rosbags``' reader with a bound on what a chunk unpacks to."""

    def read_chunk(self) -> Chunk:
        chunk = super().read_chunk()
        assert self.bio
        unpack = {bz2.decompress: _unpack_bz2, lz4.frame.decompress: _unpack_lz4}.get(chunk.decompressor)
        return chunk if unpack is None else chunk._replace(decompressor=unpack)


def _unpack_bz2(data: bytes) -> bytes:
    return _bounded(bz2.BZ2Decompressor().decompress(data, MOST_BYTES + 1))


def _unpack_lz4(data: bytes) -> bytes:
    unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, MOST_BYTES + 1)
    return _bounded(unpacked)


def _bounded(unpacked: bytes) -> bytes:
    if len(unpacked) > MOST_BYTES:
        raise ValueError(f"a chunk unpacks to more than {MOST_BYTES >> 20} MiB")
    return unpacked


def unpacked_message(data: bytes) -> bytes:
    """A message, unpacked where rosbag2 compressed it by itself; CDR never begins like a Zstandard frame."""
    if data[:4] != ZSTD_MAGIC:
        return data
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        return _bounded(stream.read(MOST_BYTES + 1))


def _bag_topic(connection: Connection) -> BagTopic:
    extra = connection.ext
    serialization = extra.serialization_format if isinstance(extra, ConnectionExtRosbag2) else "ros1"
    return BagTopic(connection.topic, connection.msgtype, serialization, connection.msgcount, connection.digest)
