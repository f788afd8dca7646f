"""Drives as rosbag2 folders, which ROS 2, Foxglove and other software open."""

import json
import sqlite3
from collections.abc import Mapping
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Literal

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from refseq.drafts import remove_folder
from refseq.errors import LogError
from refseq.files import followed, free_names, naming_writes, put_folder
from refseq.logs.closing import DriveWriter
from refseq.logs.rig import SensorRig
from refseq.logs.ros.bag import VIEWS_KEY
from refseq.logs.ros.contents import STATIC_TOPIC
from refseq.logs.ros.decoder import Serialization, known_types
from refseq.logs.ros.files import METADATA_FILE, STORAGE_SUFFIXES
from refseq.logs.ros.outgoing import RosMessage, ViewMessages, camera_topics
from refseq.logs.source import NANOSECONDS
from refseq.logs.writing import words_of, writable
from refseq.planar import Pose
from refseq.view import View

FORMAT_VERSION: Literal[8] = 8
"""Of rosbag2's metadata: from 9 on it spells quality of service in a way that ROS 2 before Jazzy does not read."""
FOREVER = QosTime(2147483647, 4294967295)
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    FOREVER,
    FOREVER,
    QosLiveliness.AUTOMATIC,
    FOREVER,
    False,
)
"""Quality of service of ``/tf_static``: who subscribes later gets the mounts as well."""


class BagStorage(StrEnum):
    """Files in a rosbag2 folder."""

    MCAP = "mcap"
    SQLITE3 = "sqlite3"


@dataclass(frozen=True)
class BagFormat:
    """The format of rosbag2 folders, in either ``storage``."""

    storage: BagStorage = BagStorage.MCAP

    def check(self, path: Path) -> None:
        """Raise ``LogError`` where a bag cannot lie."""
        check_bag_path(path)

    def open(self, path: Path, metadata: Mapping[str, str], rig: SensorRig | None = None) -> "BagWriter":
        """Begin a bag at ``path``; ``rig`` becomes its transforms and calibrations. Raises ``LogError``."""
        self.check(path)
        return BagWriter(path, metadata, storage=self.storage, rig=rig)


class BagWriter(DriveWriter):
    """Writes a drive to a rosbag2 folder, ``path``.

    While it is open the bag lies in a new folder beside ``path``, ``<name>.partial`` where nothing is called so, and is
    readable up to the last view even if the process is killed; closing it gives it its name, which replaces an older
    bag. Where an error ends the ``with`` block it stays, marked as incomplete.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        *,
        storage: BagStorage = BagStorage.MCAP,
        rig: SensorRig | None = None,
    ) -> None:
        """Begin a bag; nothing lies at ``path`` until it is closed.

        Raises ``LogError`` where it cannot be written, or something else than a bag lies there.
        """
        check_bag_path(path)
        metadata = words_of(metadata)  # before there is a folder
        self.path = path
        self._store = known_types(Serialization.CDR)
        self._messages = ViewMessages(self._store, rig or SensorRig())
        self._connections: dict[str, Connection] = {}
        self._cameras: dict[str, str] = {}
        self._open, self._placed = True, False
        with ExitStack() as undo, self._telling():
            self._place = followed(path)
            self._folder = _new_folder(self._place.with_name(f"{self._place.name}.partial"))
            undo.callback(remove_folder, self._folder)  # nothing stays of a bag that could not be begun
            self.partial = self._folder / self._place.name  # the files in it are named by the folder
            plugin = StoragePlugin[storage.name]
            self._writer = Writer(self.partial, version=FORMAT_VERSION, storage_plugin=plugin)
            self._writer.open()
            if isinstance(self._writer.storage, Sqlite3Writer):
                # To outlive the process it need not wait for the disk at each view; what is finished is synced.
                self._writer.storage.conn.execute("PRAGMA synchronous = OFF")
            undo.pop_all()
        self.note(metadata)

    def write(self, view: View, odometry: Pose) -> None:
        """Add a view, and the odometer's pose at it. Raises ``LogError`` when it cannot be written."""
        view = writable(view, odometry)
        logged = round(view.time * NANOSECONDS)
        if not 0 <= logged < 1 << 62:
            raise LogError(f"{self.path}: a view is at {view.time} s; valid in a bag are times from 0 on")
        self._cameras |= camera_topics([*dict.fromkeys([*self._cameras.values(), *view.images])])
        fixed = [] if self._connections else list(self._messages.fixed(logged))
        with self._telling():
            for message in (*fixed, *self._messages.of(view, odometry)):
                self._log(message, logged)
            self._flush()
        self.written += 1

    def _flush(self) -> None:
        """Hand what was written so far to the system, where it outlives the process."""
        match self._writer.storage:
            case McapWriter() as storage:
                storage.close_chunk()
                storage.bio.flush()
            case Sqlite3Writer() as storage:
                storage.conn.commit()

    def _log(self, message: RosMessage, logged: int) -> None:
        connection = self._connections.get(message.topic)
        if connection is None:
            quality = (LATCHED,) if message.topic == STATIC_TOPIC else ()
            connection = self._connections[message.topic] = self._writer.add_connection(
                message.topic, message.type, typestore=self._store, offered_qos_profiles=quality
            )
        self._writer.write(connection, logged, self._store.serialize_cdr(message.content, message.type))

    def note(self, metadata: Mapping[str, str]) -> None:
        """Add to what is told of the drive; of two values of a key the later one counts."""
        for key, value in words_of(metadata).items():
            self._writer.set_custom_data(key, value)

    def close(self) -> None:
        """Finish the bag and give it its name. Raises ``LogError`` when it cannot be written."""
        if not self._open:
            return
        with self._telling():
            self._finish()
            check_bag_path(self.path)
            put_folder(self.partial, self._place)
            self._placed = True
        remove_folder(self._folder)  # with the older bag, if there was one

    def leave(self, notes: Mapping[str, str]) -> None:
        """Finish the bag where it lies, with ``notes``; on a full disk it stays as it is, cut off."""
        if self._open:
            self.note(notes)
            with suppress(OSError, sqlite3.Error, WriterError):
                self._finish()

    def discard(self) -> None:
        """Give the bag up: what is at ``path`` stays as it was."""
        if self._open:
            self._open = False
            with suppress(OSError, sqlite3.Error):
                self._writer.abort()
        if not self._placed:
            remove_folder(self._folder)

    def _finish(self) -> None:
        self._open = False
        self._writer.set_custom_data(VIEWS_KEY, json.dumps(self._cameras))
        self._writer.close()

    def _telling(self) -> AbstractContextManager[None]:
        """Name the bag in what goes wrong with writing."""
        return naming_writes(self.path, LogError, sqlite3.Error, WriterError)


def _new_folder(path: Path) -> Path:
    """Make a folder that is not there yet, for us alone."""
    for name in free_names(path):
        with suppress(FileExistsError):
            name.mkdir(mode=0o700)
            return name
    raise AssertionError


def check_bag_path(path: Path) -> None:
    """Raise ``LogError`` where something lies at ``path`` that a bag may not replace."""
    if odd := next((letter for letter in "?#%" if letter in str(path)), None):
        # SQLite's writer would take them for parts of a URI.
        raise LogError(f"{path}: has a {odd!r} in its name; valid for a rosbag2 are names without ?, # and %")
    if path.exists() and not path.is_dir():
        raise LogError(f"{path}: is a file; valid for a rosbag2 is the name of a folder")
    names = sorted(file.name for file in path.iterdir()) if path.is_dir() else []
    others = [name for name in names if name != METADATA_FILE and not name.endswith(STORAGE_SUFFIXES)]
    if others or (names and METADATA_FILE not in names):
        raise LogError(f"{path}: is a folder with {(others or names)[0]!r}; valid is a new name, or a bag to replace")
