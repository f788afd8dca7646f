"""Drives as MCAP files with Foxglove schemas: written view by view, readable up to the last one when cut off.

Topics: ``/<camera>`` CompressedImage (PNG), ``/laser`` LaserScan, ``/odometry`` Odometry, ``/truth`` PoseInFrame,
``/behaviour`` Log. All messages of one view carry the same log time. One metadata record, written first, says how the
drive was made.
"""

import io
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import foxglove
import numpy as np
from foxglove import messages
from foxglove.channels import (
    CompressedImageChannel,
    LaserScanChannel,
    LogChannel,
    OdometryChannel,
    PoseInFrameChannel,
)
from foxglove.mcap import MCAPWriteOptions
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.recording import Recording, TimedData, views_of
from refseq.planar import Pose
from refseq.view import LASER, Scan, View

MCAP_MAGIC = b"\x89MCAP0\r\n"
METADATA_NAME = "refseq"
ODOMETRY_TOPIC = "/odometry"
TRUTH_TOPIC = "/truth"
BEHAVIOUR_TOPIC = "/behaviour"
NANOSECONDS = 1_000_000_000
FAST_PNG = (
    *(int(cv2.IMWRITE_PNG_COMPRESSION), 1),
    *(int(cv2.IMWRITE_PNG_FILTER), int(cv2.IMWRITE_PNG_FILTER_AVG)),
    *(int(cv2.IMWRITE_PNG_STRATEGY), int(cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY)),
)
"""A quarter less time than OpenCV's default, and a twelfth smaller: noise leaves no repetitions to look for, and the
mean of two neighbours has less of it than one."""


class RecordingWriter:
    """Writes a drive to ``path``, one chunk a view.

    While it is open the file is ``<name>.partial.mcap`` beside ``path``, and readable up to the last view even if the
    process is killed; closing it renames it to ``path``, which replaces an older recording in one step.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str]) -> None:
        self.path = path
        self.partial = path.with_name(f"{path.stem}.partial.mcap")
        self._context = foxglove.Context()
        self._images: dict[str, CompressedImageChannel] = {}
        try:
            self._writer = foxglove.open_mcap(
                str(self.partial),
                allow_overwrite=True,
                context=self._context,
                # PNG does not shrink further, and an uncompressed chunk survives a cut in its middle the best.
                writer_options=MCAPWriteOptions(compression=None, profile="refseq"),
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise LogError(f"{path}: cannot be written: {error}") from error
        self._open = True
        self.note(metadata)
        self._laser = LaserScanChannel(f"/{LASER}", context=self._context)
        self._odometry = OdometryChannel(ODOMETRY_TOPIC, context=self._context)
        self._truth = PoseInFrameChannel(TRUTH_TOPIC, context=self._context)
        self._behaviour: LogChannel | None = None  # most drives tell of none

    def write(self, view: View, odometry: Pose) -> None:
        """Add a view; ``odometry`` is the pose that the robot's odometer shows, from which motion is read back.

        Raises ``LogError`` when it cannot be written, on a full disk say.
        """
        with self._telling():
            self._write(view, odometry)

    def _write(self, view: View, odometry: Pose) -> None:
        nanoseconds = round(view.time * NANOSECONDS)
        stamp = messages.Timestamp(sec=nanoseconds // NANOSECONDS, nsec=nanoseconds % NANOSECONDS)
        for camera, image in view.images.items():
            channel = self._images.get(camera)
            if channel is None:
                channel = self._images[camera] = CompressedImageChannel(f"/{camera}", context=self._context)
            data = cv2.imencode(".png", image, FAST_PNG)[1].tobytes()
            channel.log(
                messages.CompressedImage(timestamp=stamp, frame_id=camera, data=data, format="png"),
                log_time=nanoseconds,
            )
        if view.scan is not None:
            self._laser.log(_laser_message(view.scan, stamp), log_time=nanoseconds)
        if view.truth is not None:
            self._truth.log(
                messages.PoseInFrame(timestamp=stamp, frame_id="world", pose=_pose_message(view.truth)),
                log_time=nanoseconds,
            )
        if view.behaviour:
            self._behaviour = self._behaviour or LogChannel(BEHAVIOUR_TOPIC, context=self._context)
            told = messages.Log(timestamp=stamp, level=messages.LogLevel.Info, message=view.behaviour, name="behaviour")
            self._behaviour.log(told, log_time=nanoseconds)
        self._odometry.log(
            messages.Odometry(
                timestamp=stamp, frame_id="odometry", body_frame_id="robot", pose=_pose_message(odometry)
            ),
            log_time=nanoseconds,
        )
        self._writer.flush()

    def note(self, metadata: Mapping[str, str]) -> None:
        """Add to what is told of the drive; of two values of a key the later one counts."""
        if metadata:
            self._writer.write_metadata(METADATA_NAME, dict(metadata))

    def close(self) -> None:
        """Finish the file and give it its name. Raises ``LogError`` when it cannot be written."""
        if not self._open:
            return
        self._open = False
        with self._telling():
            self._writer.close()
            self.partial.replace(self.path)

    def discard(self) -> None:
        """Give the file up: what is at ``path`` stays as it was."""
        self._open = False
        with self._telling():
            self._writer.close()
            self.partial.unlink(missing_ok=True)

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Name the file in what goes wrong with writing."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            raise LogError(f"{self.path}: cannot be written (is the disk full?): {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except LogError:
            if error is None:  # else what went wrong first is what tells why
                raise


def _laser_message(scan: Scan, stamp: messages.Timestamp) -> messages.LaserScan:
    bearings = scan.bearings
    return messages.LaserScan(
        timestamp=stamp,
        frame_id=LASER,
        start_angle=float(bearings[0]),
        end_angle=float(bearings[-1]),
        ranges=scan.ranges.astype(float).tolist(),
    )


def _pose_message(pose: Pose) -> messages.Pose:
    half = pose.heading / 2
    return messages.Pose(
        position=messages.Vector3(x=pose.x, y=pose.y, z=0.0),
        orientation=messages.Quaternion(x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half))),
    )


def read_mcap(path: Path) -> Recording:
    """Read a drive; one that was cut off or damaged yields its views up to there, and ``complete`` is False.

    A view's distance and turn come from the odometer poses of it and the view before. Topics of other schemas are
    counted in ``skipped``. Raises ``LogError`` when the file is not MCAP or holds no view.
    """
    moments: dict[int, TimedData] = {}
    metadata: dict[str, str] = {}
    skipped: dict[str, int] = {}
    complete = False
    try:
        for record in _records(path):
            match record:
                case Metadata(name=name) if name == METADATA_NAME:
                    metadata.update(record.metadata)
                case Footer():
                    complete = True
                case (topic, schema, time, message):
                    moment = moments.setdefault(time, TimedData(time / NANOSECONDS))
                    if not _take(moment, topic.removeprefix("/"), schema, message, path):
                        skipped[schema] = skipped.get(schema, 0) + 1
    except McapError as error:
        complete = False
        if not moments:
            raise LogError(
                f"{path}: is cut off or damaged before its first view: {_reason(error)}; "
                "valid is a recording of at least one view"
            ) from error
    views = tuple(views_of(_sensed(moments)))
    if not views:
        raise LogError(f"{path}: holds no view; valid are Foxglove CompressedImage, LaserScan and Odometry messages")
    return Recording(views, metadata, complete, skipped)


def _reason(error: McapError) -> str:
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


def _records(path: Path) -> Iterator[Any]:
    """Yield the file's metadata and footer records, and its messages as (topic, schema name, time, content).

    Raises ``McapError`` where the file is cut off or damaged.
    """
    with _WholeReads(path) as file:
        try:
            yield from _decoded(StreamReader(file, validate_crcs=True))
        except (struct.error, ValueError, KeyError, TypeError, DecodeError) as error:
            # What the libraries raise for bytes that make no record or message.
            raise McapError(f"bytes that make no record: {error}") from error


def _decoded(reader: StreamReader) -> Iterator[Any]:
    factory = DecoderFactory()
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for record in reader.records:
        match record:
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Message():
                channel = channels[record.channel_id]
                schema = schemas.get(channel.schema_id)
                decode = factory.decoder_for(channel.message_encoding, schema)
                if schema is None or decode is None:
                    yield (channel.topic, channel.message_encoding, record.log_time, None)
                else:
                    yield (channel.topic, schema.name, record.log_time, decode(record.data))
            case Metadata() | Footer():
                yield record


def _take(moment: TimedData, name: str, schema: str, message: Any, path: Path) -> bool:
    """Put one message where it belongs in its moment; False when its schema is none that is read."""
    match schema:
        case "foxglove.CompressedImage":
            moment.images[name] = _decode_image(message.data, name, path)
        case "foxglove.LaserScan":
            moment.scan = _decode_scan(message)
        case "foxglove.Odometry":
            moment.odometry = _decode_pose(message.pose)
        case "foxglove.PoseInFrame":
            moment.truth = _decode_pose(message.pose)
        case "foxglove.Log" if name == BEHAVIOUR_TOPIC.removeprefix("/"):
            moment.behaviour = message.message
        case _:
            return False
    return True


def _decode_image(data: bytes, name: str, path: Path) -> NDArray[np.uint8]:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise LogError(f"{path}: topic /{name}: an image cannot be decoded; valid are PNG and JPEG")
    return np.asarray(image, np.uint8)


def _decode_scan(message: Any) -> Scan:
    ranges = np.asarray(message.ranges, np.float32)
    step = (message.end_angle - message.start_angle) / max(1, len(ranges) - 1)
    return Scan(ranges, float(message.start_angle), float(step))


def _decode_pose(message: Any) -> Pose:
    rotation = message.orientation
    return Pose(message.position.x, message.position.y, 2.0 * float(np.arctan2(rotation.z, rotation.w)))


def _sensed(moments: Mapping[int, TimedData]) -> Iterator[TimedData]:
    """Time stamps with an image or a scan, in order; where no odometer was recorded the true pose stands for it."""
    for _, moment in sorted(moments.items()):
        if moment.images or moment.scan is not None:
            moment.odometry = moment.odometry or moment.truth
            yield moment
