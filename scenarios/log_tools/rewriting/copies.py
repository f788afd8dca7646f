"""Copies of a stretch of a log in its own format, message by message as they are."""

import bz2
import gzip
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO, NamedTuple, cast

from mcap.exceptions import McapError
from mcap.records import Channel, Footer, Header, Metadata, Schema
from mcap.writer import Writer as McapWriter
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag1 import Reader as Rosbag1Reader
from rosbags.rosbag1 import ReaderError as Rosbag1Error
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import Reader as Rosbag2Reader
from rosbags.rosbag2 import ReaderError as Rosbag2Error
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer

from refseq.drafts import draft_folder
from refseq.errors import LogError
from refseq.files import followed, put_folder, replacing, replacing_at
from refseq.logs.carmen.source import LineSpan
from refseq.logs.carmen.text import CutOffError, is_carmen, text_lines
from refseq.logs.closing import incomplete
from refseq.logs.foxglove.records import McapMessage, is_mcap, reason, records
from refseq.logs.foxglove.writer import METADATA_NAME
from refseq.logs.ros.storage import ROSBAG1_MAGIC

MCAP: tuple[str, ...] = (".mcap",)
ROSBAG1: tuple[str, ...] = (".bag",)
CARMEN: tuple[str, ...] = (".clf", ".log", ".carmen")
PACKED: tuple[str, ...] = (".gz", ".bz2")
"""Endings of the names of each kind of log."""
LATCHED = ("/tf_static", "/robot_description")
"""Topics whose last message before the stretch holds within it: it is written at its beginning."""


class LoggedSpan(NamedTuple):
    """A stretch of a log by the times of logging [ns], both ends among it."""

    first: int
    last: int

    def place(self, time: int, topic: str) -> int | None:
        """The time at which a message is written to the copy; None of one that is left out."""
        if self.first <= time <= self.last:
            return time
        latched = topic in LATCHED or "camera_info" in topic
        return self.first if latched and time < self.first else None


def check_copy(source: Path, target: Path) -> None:
    """Raise ``LogError`` before the work begins where ``source`` cannot be copied, or not to ``target``."""
    folder = not is_carmen(source) and _copier(source) is _copy_rosbag2
    if folder and target.exists():
        raise LogError(f"{target}: is there already; valid is the name of a folder to make")
    if not folder and target.is_dir():
        raise LogError(f"{target}: is a folder; valid is the name of a file to write")
    if not target.parent.is_dir():
        raise LogError(f"{target}: cannot be written: there is no folder {target.parent}")
    _check_ending(source, target)


def _check_ending(source: Path, target: Path) -> None:
    """Raise ``LogError`` for a name of another kind of log: a copy is of its source's kind, whatever it is called."""
    valid, packed = _endings(source), PACKED if is_carmen(source) else ()
    ending = (target.with_suffix("") if target.suffix in packed else target).suffix.lower()
    others = (*MCAP, *ROSBAG1, *CARMEN, *PACKED)
    if ending in valid or (target.suffix == source.suffix if valid else ending not in others):
        return
    behind = f", packed with {' or '.join(packed)} behind" if packed else ""
    told = f"one that ends in {', '.join(valid)}{behind}" if valid else f"one of a folder, without {', '.join(others)}"
    raise LogError(f"{target}: is no name for a stretch of {source}, which keeps its format; valid is {told}")


def _endings(source: Path) -> tuple[str, ...]:
    """Endings of the names of a log of this one's kind; none of a folder."""
    if is_carmen(source):
        return CARMEN
    copy = _copier(source)
    return MCAP if copy is _copy_mcap else ROSBAG1 if copy is _copy_rosbag1 else ()


def copy_stretch(source: Path, target: Path, span: LoggedSpan | LineSpan, notes: Mapping[str, str]) -> int:
    """Copy what was logged in ``span``, with ``notes`` added to the log's own; the number of messages.

    The stretch of a CARMEN log is one of lines. ``target`` is replaced in one step. Raises ``LogError`` for kinds of
    logs that cannot be copied, and for damage before the stretch begins.
    """
    if isinstance(span, LineSpan):
        return _copy_carmen(source, target, span, notes)
    copy = _copier(source)
    try:
        return copy(source, target, span, notes)
    except (Rosbag1Error, Rosbag2Error, McapError) as error:
        raise LogError(f"{source}: cannot be copied: {' '.join(str(error).split())}") from error


def _copier(source: Path) -> Callable[[Path, Path, LoggedSpan, Mapping[str, str]], int]:
    if source.is_dir():
        if not (source / "metadata.yaml").is_file():
            raise LogError(f"{source}: is a folder that cannot be cut; valid are rosbag2 folders, MCAP, ROS 1, CARMEN")
        return _copy_rosbag2
    if is_mcap(source):
        return _copy_mcap
    with source.open("rb") as file:
        head = file.read(len(ROSBAG1_MAGIC))
    if head == ROSBAG1_MAGIC:
        return _copy_rosbag1
    return _copy_rosbag2


def _copy_mcap(source: Path, target: Path, span: LoggedSpan, notes: Mapping[str, str]) -> int:
    count = 0
    with replacing(target) as file:
        writer = McapWriter(file)
        known: dict[int, int] = {}
        begun, damage = False, "unexpected end of file"
        try:  # of a log that was cut off, what lies before the cut
            for record in records(source):
                if isinstance(record, Header):
                    writer.start(record.profile, "refseq log cut")
                    writer.add_metadata(METADATA_NAME, dict(notes))
                    begun = True
                elif isinstance(record, Metadata):
                    writer.add_metadata(record.name, record.metadata)
                elif isinstance(record, McapMessage):
                    count += _copy_message(writer, record, known, span)
                elif isinstance(record, Footer):
                    damage = ""
        except McapError as error:
            damage = reason(error)
        if not begun:
            raise LogError(f"{source}: is damaged before its first message")
        if damage:
            writer.add_metadata(METADATA_NAME, incomplete(damage))
        writer.finish()  # type: ignore[no-untyped-call]
    return count


def _copy_message(writer: McapWriter, record: McapMessage, known: dict[int, int], span: LoggedSpan) -> bool:
    channel, message = record.channel, record.message
    at = span.place(message.log_time, channel.topic)
    if at is None:
        return False
    if channel.id not in known:
        known[channel.id] = _registered(writer, channel, record.schema)
    writer.add_message(known[channel.id], at, message.data, message.publish_time, message.sequence)
    return True


def _registered(writer: McapWriter, channel: Channel, schema: Schema | None) -> int:
    number = 0 if schema is None else writer.register_schema(schema.name, schema.encoding, schema.data)
    return int(writer.register_channel(channel.topic, channel.message_encoding, number, dict(channel.metadata)))


def _copy_rosbag1(source: Path, target: Path, span: LoggedSpan, notes: Mapping[str, str]) -> int:
    """A ROS 1 bag has no place for notes."""
    with replacing_at(target) as made, Rosbag1Reader(source) as bag, Rosbag1Writer(made) as writer:
        return _copy_messages(bag, writer, span, partial(_added_rosbag1, writer))


def _copy_rosbag2(source: Path, target: Path, span: LoggedSpan, notes: Mapping[str, str]) -> int:
    plugin = StoragePlugin.MCAP if any(source.glob("*.mcap*")) else StoragePlugin.SQLITE3
    with (
        _new_folder(target) as made,
        Rosbag2Reader(source) as bag,
        Rosbag2Writer(made, version=8, storage_plugin=plugin) as writer,
    ):
        for key, value in {**(bag.storage.metadata.custom or {}), **notes}.items():
            writer.set_custom_data(str(key), str(value))
        return _copy_messages(bag, writer, span, partial(_added_rosbag2, writer))


def _copy_messages(
    bag: Rosbag1Reader | Rosbag2Reader,
    writer: Rosbag1Writer | Rosbag2Writer,
    span: LoggedSpan,
    added: Callable[[Connection], Connection],
) -> int:
    """Copy a bag's messages; connections are ``added`` as they come. The number of messages."""
    count = 0
    known: dict[int, Connection] = {}
    for connection, time, data in bag.messages():
        at = span.place(time, connection.topic)
        if at is None:
            continue
        if connection.id not in known:
            known[connection.id] = added(connection)
        writer.write(known[connection.id], at, data)
        count += 1
    return count


def _added_rosbag1(writer: Rosbag1Writer, connection: Connection) -> Connection:
    return writer.add_connection(
        connection.topic, connection.msgtype, msgdef=connection.msgdef.data, md5sum=connection.digest
    )


def _added_rosbag2(writer: Rosbag2Writer, connection: Connection) -> Connection:
    ext = connection.ext
    return writer.add_connection(
        connection.topic,
        connection.msgtype,
        msgdef=connection.msgdef.data,
        rihs01=connection.digest,
        offered_qos_profiles=ext.offered_qos_profiles if isinstance(ext, ConnectionExtRosbag2) else (),
    )


@contextmanager
def _new_folder(target: Path) -> Iterator[Path]:
    """A folder's name that becomes ``target`` when the block ends well; a link stays one, as of files."""
    target = followed(target)
    with draft_folder(target.parent) as folder:
        yield folder / target.name
        put_folder(folder / target.name, target)


def _copy_carmen(source: Path, target: Path, span: LineSpan, notes: Mapping[str, str]) -> int:
    """Lines of the stretch as they are; parameters and comments all. Of a log that was cut off, what lies before."""
    count = 0
    with replacing_at(target) as temporary, _packed(temporary) as file, suppress(CutOffError):
        told = (f"PARAM {key} {'_'.join(value.split())} 0 refseq 0\n" for key, value in notes.items() if value)
        file.writelines(line.encode() for line in told)
        for number, line in enumerate(text_lines(source), 1):
            word = line.split(None, 1)[0] if line.strip() else b"#"
            if word.startswith(b"#") or word == b"PARAM":
                file.write(line)
            elif number in span:
                file.write(line)
                count += 1
    return count


def _packed(path: Path) -> IO[bytes]:
    """A file to write, packed where its name says so."""
    if path.suffix == ".gz":
        return cast(IO[bytes], gzip.open(path, "wb"))
    return bz2.open(path, "wb") if path.suffix == ".bz2" else path.open("wb")
