"""Files of bags as streams of serialised messages: SQLite and ROS 1 through ``rosbags``, each opened by its content."""

import bz2
from collections.abc import Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol
from urllib.parse import quote

import apsw
import lz4.frame  # type: ignore[import-untyped]
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag1 import Reader as Rosbag1Reader
from rosbags.rosbag1.reader import Chunk, ChunkInfo
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from refseq.errors import LogError
from refseq.files import check_input
from refseq.limits import CHUNK_BYTES, TOPICS, UNPACKED_BYTES
from refseq.logs.decoding.unpacking import WholeReads, translating, unpack_bz2, unpack_lz4, unpack_zstd

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


def _damage_told(path: Path) -> AbstractContextManager[None]:
    """Raise what the libraries raise for a file that is no bag, or no longer one, as ``DamagedBagError``."""
    return translating(lambda reason: DamagedBagError(path, reason))


class SqliteBag:
    """One ``.db3`` file of a rosbag2, with a ``metadata.yaml`` beside it or without."""

    damage = ""
    metadata_text = ""

    def __init__(self, path: Path, told: Path | None = None) -> None:
        """Open a file; messages name it ``told``, where the user's own is a packed one."""
        self.path, self.told = path, told or path
        with _damage_told(self.told), self._opened() as reader:
            self.topics = tuple(map(_bag_topic, reader.connections))
            TOPICS.check(len(self.topics), f"{self.told}: has")

    @contextmanager
    def _opened(self) -> Iterator[Sqlite3Reader]:
        check_input(self.path)
        reader = Sqlite3Reader(_UriPath(self.path))
        with _plain_tables():
            reader.open()
        try:
            _check_texts(map(_bag_topic, reader.connections))
            yield reader
        finally:
            reader.close()

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in order of logging; unpacked where each was compressed."""
        unpacked = UNPACKED_BYTES.of(self.path)
        with _damage_told(self.told), self._opened() as reader:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            for connection, logged, data in reader.messages(wanted):
                if not (isinstance(logged, int) and isinstance(data, bytes)):
                    raise ValueError(f"a message's time is {logged!r:.20}, its data {type(data).__name__}")
                found = unpacked_message(data)
                unpacked.add(len(found))
                yield StoredMessage(connection.topic, connection.msgtype, logged, found)


def _check_texts(topics: Iterable[BagTopic]) -> None:
    """Raise ``ValueError`` where a column of texts holds something else: SQLite keeps whatever it is given."""
    for one in topics:
        for text in (one.topic, one.type, one.serialization, one.digest):
            if not isinstance(text, str):
                raise ValueError(f"a topic has {text!r:.40} where a text belongs")


@contextmanager
def _plain_tables() -> Iterator[None]:
    """Open databases as SQLite advises for files of strangers: what they hold are tables, and no programs.

    A view or a trigger may never end, and a column may be computed to any size.
    """

    def hook(connection: apsw.Connection) -> None:
        connection.limit(apsw.SQLITE_LIMIT_LENGTH, CHUNK_BYTES)
        for switch in (apsw.SQLITE_DBCONFIG_ENABLE_VIEW, apsw.SQLITE_DBCONFIG_ENABLE_TRIGGER):
            connection.config(switch, 0)
        connection.config(apsw.SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0)
        connection.config(apsw.SQLITE_DBCONFIG_DEFENSIVE, 1)

    apsw.connection_hooks.append(hook)
    try:
        yield
    finally:
        apsw.connection_hooks.remove(hook)


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
            TOPICS.check(len(self.topics), f"{self.told}: has")

    def messages(self, topics: Collection[str]) -> Iterator[StoredMessage]:
        """Messages of these topics in order of logging."""
        # An index may lead to one message as often as it likes.
        unpacked = UNPACKED_BYTES.of(self.path)
        with _damage_told(self.told), _Rosbag1Reader(self.path) as reader:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            for connection, logged, data in reader.messages(wanted) if wanted else ():
                unpacked.add(len(data))
                if connection.topic not in topics:
                    raise ValueError(f"its index leads to a message of {connection.topic} instead of another topic's")
                yield StoredMessage(connection.topic, connection.msgtype, logged, data)


class _Rosbag1Reader(Rosbag1Reader):
    """``rosbags``' reader, which takes no more memory than the file and its limits allow."""

    def __init__(self, path: Path) -> None:
        super().__init__(_WholePath(path))
        self._unpacked = UNPACKED_BYTES.of(path)
        self._chunks_seen: set[int] = set()

    def read_chunk_info(self) -> ChunkInfo:
        info = super().read_chunk_info()
        if info.pos in self._chunks_seen:
            raise ValueError("its index names a chunk twice")
        self._chunks_seen.add(info.pos)
        return info

    def read_chunk(self) -> Chunk:
        chunk = super().read_chunk()
        unpack = {bz2.decompress: unpack_bz2, lz4.frame.decompress: unpack_lz4}.get(chunk.decompressor)
        if unpack is None:
            return chunk

        def bounded(data: bytes) -> bytes:
            found = unpack(data)
            self._unpacked.add(len(found))
            return found

        return chunk._replace(decompressor=bounded)


class _WholePath(type(Path())):  # type: ignore[misc]
    """A path that is opened as a file that has all that is asked of it."""

    def open(self, *_: Any) -> WholeReads:
        return WholeReads(Path(self))


def unpacked_message(data: bytes) -> bytes:
    """A message, unpacked where rosbag2 compressed it by itself; CDR never begins like a Zstandard frame."""
    return data if data[:4] != ZSTD_MAGIC else unpack_zstd(data)


def _bag_topic(connection: Connection) -> BagTopic:
    extra = connection.ext
    serialization = extra.serialization_format if isinstance(extra, ConnectionExtRosbag2) else "ros1"
    return BagTopic(connection.topic, connection.msgtype, serialization, connection.msgcount, connection.digest)
