"""Formats in which drives are written, and their writers."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self

from refseq.errors import LogError
from refseq.planar import Pose
from refseq.view import View

if TYPE_CHECKING:
    from refseq.logs.ros.outgoing import SensorRig


class DriveFormat(StrEnum):
    """A file of Foxglove's messages, or a folder of ROS 2's in either storage."""

    MCAP = "mcap"
    ROSBAG2 = "rosbag2"
    ROSBAG2_SQLITE3 = "rosbag2-sqlite3"


class DriveWriter(Protocol):
    """A drive that is being written; it is at its place when it has been closed."""

    def write(self, view: View, odometry: Pose) -> None:
        """Add a view, and the odometer's pose at it. Raises ``LogError`` when it cannot be written."""
        ...

    def note(self, metadata: Mapping[str, str]) -> None:
        """Add to what is told of the drive; of two values of a key the later one counts."""
        ...

    def close(self) -> None:
        """Finish, and put the drive at its place. Raises ``LogError`` when it cannot be written."""
        ...

    def discard(self) -> None:
        """Give the drive up: what lies at its place stays as it was."""
        ...

    def __enter__(self) -> Self:
        """Return the writer itself, for a ``with`` block that closes it."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        ...


def check_place(path: Path, form: DriveFormat = DriveFormat.MCAP) -> None:
    """Raise ``LogError`` where a drive of this format cannot lie."""
    if form is DriveFormat.MCAP:
        if path.is_dir():
            raise LogError(f"{path}: is a folder; valid is the name of a recording to write")
        return
    from refseq.logs.ros.writer import check_bag_path

    check_bag_path(path)


def open_writer(
    path: Path,
    metadata: Mapping[str, str],
    form: DriveFormat = DriveFormat.MCAP,
    rig: "SensorRig | None" = None,
) -> DriveWriter:
    """Begin a drive at ``path``; ``rig`` tells of mounts and calibrations where the format has a place for them.

    Raises ``LogError`` where it cannot be written.
    """
    check_place(path, form)
    if form is DriveFormat.MCAP:
        from refseq.logs.foxglove.writer import RecordingWriter

        return RecordingWriter(path, metadata)
    from refseq.logs.ros.writer import BagStorage, BagWriter

    storage = BagStorage.MCAP if form is DriveFormat.ROSBAG2 else BagStorage.SQLITE3
    return BagWriter(path, metadata, storage=storage, rig=rig)
