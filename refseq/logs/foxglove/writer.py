"""Drives as MCAP files with Foxglove schemas: written view by view, readable up to the last one when cut off.

Topics: ``/<camera>`` CompressedImage (PNG), ``/laser`` LaserScan, ``/odometry`` Odometry, ``/truth`` PoseInFrame,
``/behaviour`` Log. All messages of one view carry the same log time. One metadata record, written first, says how the
drive was made.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING

import foxglove
from foxglove import messages
from foxglove.channels import (
    CompressedImageChannel,
    LaserScanChannel,
    LogChannel,
    OdometryChannel,
    PoseInFrameChannel,
)
from foxglove.mcap import MCAPWriteOptions

from refseq.errors import LogError
from refseq.files import followed, free_names, naming_writes, put
from refseq.logs.closing import DriveWriter
from refseq.logs.foxglove.outgoing import nanoseconds_of, picture_message, pose_message, scan_message, stamp_message
from refseq.logs.rig import SensorRig
from refseq.logs.writing import words_of, writable
from refseq.planar import Pose
from refseq.view import LASER, View

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

PROFILE = METADATA_NAME = "refseq"
ODOMETRY_TOPIC = "/odometry"
TRUTH_TOPIC = "/truth"
BEHAVIOUR_TOPIC = "/behaviour"


class RecordingFormat:
    """The format of the bench's own recordings."""

    def check(self, path: Path) -> None:
        """Raise ``LogError`` where a recording cannot lie."""
        if path.is_dir():
            raise LogError(f"{path}: is a folder; valid is the name of a recording to write")

    def open(self, path: Path, metadata: Mapping[str, str], rig: SensorRig | None = None) -> "RecordingWriter":
        """Begin a recording at ``path``, which has no place for a ``rig``. Raises ``LogError``."""
        self.check(path)
        return RecordingWriter(path, metadata)


class RecordingWriter(DriveWriter):
    """Writes a drive to ``path``, one chunk a view.

    While it is open the file is a new one beside ``path``, ``<name>.partial.mcap`` where nothing is called so, and
    readable up to the last view even if the process is killed; closing it renames it to ``path``, which replaces an
    older recording in one step. Where an error ends the ``with`` block it stays, marked as incomplete.
    """

    def __init__(self, path: Path | str, metadata: Mapping[str, str]) -> None:
        metadata = words_of(metadata)  # before there is a file
        self.path = path = Path(path)
        self._context = foxglove.Context()
        self._images: dict[str, CompressedImageChannel] = {}
        try:
            with naming_writes(path, LogError):
                self._place = followed(path)
                self._file = _new_file(self._place.with_name(f"{self._place.stem}.partial.mcap"))
        except ValueError as error:
            raise LogError(f"{path}: cannot be written: {error}") from error
        self.partial = Path(str(self._file.name))
        with ExitStack() as undo:  # nothing stays of a file that could not be begun
            undo.callback(self.partial.unlink, missing_ok=True)
            undo.callback(self._file.close)
            with self._telling():
                self._writer = foxglove.open_mcap(
                    self._file,
                    context=self._context,
                    # PNG does not shrink further, and an uncompressed chunk survives a cut in its middle the best.
                    writer_options=MCAPWriteOptions(compression=None, profile=PROFILE),
                )
                undo.callback(self._writer.close)
            self._open, self._placed = True, False
            self.note(metadata)
            undo.pop_all()
        self._laser = LaserScanChannel(f"/{LASER}", context=self._context)
        self._odometry = OdometryChannel(ODOMETRY_TOPIC, context=self._context)
        self._truth = PoseInFrameChannel(TRUTH_TOPIC, context=self._context)
        self._behaviour: LogChannel | None = None  # most drives tell of none

    def write(self, view: View, odometry: Pose) -> None:
        """Add a view; ``odometry`` is the pose that the robot's odometer shows, from which motion is read back.

        Raises ``LogError`` when it cannot be written, on a full disk say, and as ``writable`` does.
        """
        view = writable(view, odometry)
        with self._telling():
            self._write(view, odometry)
        self.written += 1

    def _write(self, view: View, odometry: Pose) -> None:
        stamp, nanoseconds = stamp_message(view.time), nanoseconds_of(view.time)
        for camera, image in view.images.items():
            channel = self._images.get(camera)
            if channel is None:
                channel = self._images[camera] = CompressedImageChannel(f"/{camera}", context=self._context)
            channel.log(picture_message(camera, image, stamp), log_time=nanoseconds)
        if view.scan is not None:
            self._laser.log(scan_message(view.scan, stamp), log_time=nanoseconds)
        if view.truth is not None:
            truth = messages.PoseInFrame(timestamp=stamp, frame_id="world", pose=pose_message(view.truth))
            self._truth.log(truth, log_time=nanoseconds)
        if view.behaviour:
            self._behaviour = self._behaviour or LogChannel(BEHAVIOUR_TOPIC, context=self._context)
            told = messages.Log(timestamp=stamp, level=messages.LogLevel.Info, message=view.behaviour, name="behaviour")
            self._behaviour.log(told, log_time=nanoseconds)
        shown = messages.Odometry(
            timestamp=stamp, frame_id="odometry", body_frame_id="robot", pose=pose_message(odometry)
        )
        self._odometry.log(shown, log_time=nanoseconds)
        self._writer.flush()

    def note(self, metadata: Mapping[str, str]) -> None:
        """Add to what is told of the drive; of two values of a key the later one counts."""
        if metadata:
            with self._telling():
                self._writer.write_metadata(METADATA_NAME, words_of(metadata))

    def close(self) -> None:
        """Finish the file and give it its name. Raises ``LogError`` when it cannot be written."""
        if not self._open:
            return
        with self._telling():
            self._finish()
            put(self.partial, self._place)
            self._placed = True

    def leave(self, notes: Mapping[str, str]) -> None:
        """Finish the file where it lies, with ``notes``; on a full disk it stays as it is, cut off."""
        if self._open:
            with suppress(LogError):
                self.note(notes)
            with suppress(OSError, RuntimeError):
                self._finish()

    def discard(self) -> None:
        """Give the file up: what is at ``path`` stays as it was."""
        if self._open:
            with suppress(OSError, RuntimeError):
                self._finish()
        if not self._placed:
            self.partial.unlink(missing_ok=True)

    def _finish(self) -> None:
        self._open = False
        try:
            self._writer.close()
        finally:
            self._file.close()

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Name the file in what goes wrong with writing, with the system's reason."""
        with naming_writes(self.path, LogError, RuntimeError):
            try:
                yield
            finally:
                if self._file.refusal is not None:
                    raise self._file.refusal


class _PatientFile(FileIO):
    """A file that keeps the system's ``refusal`` to write, as of a full disk, and from then on only seems written.

    Foxglove's writer would tell of it in a riddle, and print it as well, once more when it is thrown away.
    """

    refusal: OSError | None = None
    _at = _end = 0  # where it would stand, and end

    def write(self, data: "ReadableBuffer", /) -> int:
        """Write what the system takes."""
        if self.refusal is None:
            try:
                return super().write(data)
            except OSError as error:
                self.refusal = error
                self._at = self._end = super().tell()
        size = memoryview(data).nbytes
        self._at += size
        self._end = max(self._end, self._at)
        return size

    def tell(self) -> int:
        """Tell where it stands, or would."""
        return super().tell() if self.refusal is None else self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Move there, or tell where that would be."""
        if self.refusal is None:
            return super().seek(offset, whence)
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._end}[whence]
        return self._at


def _new_file(path: Path) -> _PatientFile:
    """Make a file that is not there yet, and write to what was made, not to a link that was put in its place."""
    for name in free_names(path):
        with suppress(FileExistsError):
            return _PatientFile(name, "xb")
    raise AssertionError
