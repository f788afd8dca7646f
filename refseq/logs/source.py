"""Interface of every log: channels that say what they carry, and samples in the order in which they were written.

A kind of log is one ``LogKind``: how it is recognised and opened. What it opens is a ``LogSource``, which streams: no
picture is decoded before somebody asks for its pixels, and nothing is kept of the samples that have gone by.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from refseq.limits import SECONDS
from refseq.logs.decoding.picture import LazyPicture
from refseq.logs.transforms import Transform
from refseq.logs.unreadable import Unreadable
from refseq.planar import Pose
from refseq.view import Scan


class Role(StrEnum):
    """Use that the bench has for a channel."""

    CAMERA = "camera"
    LASER = "laser"
    ODOMETRY = "odometry"
    TRUTH = "truth"
    TRANSFORMS = "transforms"
    IMU = "imu"
    GPS = "gps"
    CALIBRATION = "calibration"
    BEHAVIOUR = "behaviour"
    IGNORED = "ignored"


@dataclass(frozen=True, slots=True)
class Channel:
    """One topic of a log.

    ``schema`` is the type of its messages in the log's own words (``foxglove.LaserScan``, ``FLASER``), ``encoding`` how
    they are written (``protobuf``, ``json``, ``cdr``, ``text``), ``count`` how many there are.
    """

    topic: str
    schema: str
    encoding: str
    count: int
    role: Role
    sensor: str = ""
    """Name of the sensor, where the log tells it otherwise than by the topic."""


@dataclass(frozen=True, slots=True)
class AngularRates:
    """Rates of turn about the sensor's axes [rad/s], of an inertial sensor or a gyroscope."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class GeoFix:
    """A position on the earth: ``latitude`` and ``longitude`` [°, WGS 84], ``altitude`` [m]."""

    latitude: float
    longitude: float
    altitude: float = 0.0


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """A camera's model: size [pixels], ``model`` of the distortion, its coefficients, and the matrix K by rows."""

    width: int
    height: int
    model: str
    distortion: tuple[float, ...]
    matrix: tuple[float, ...]


Content = LazyPicture | Scan | Pose | tuple[Transform, ...] | AngularRates | GeoFix | CameraCalibration | str
"""One message, by the role of its channel: a picture (camera), a scan (laser, normalised by ``refseq.logs.scans``, in
the laser's own frame), a pose (odometry or truth), transforms, rates (IMU), a fix (GPS), a calibration, a note
(behaviour)."""


def seconds_of(stamp: int) -> float:
    """A stamp [ns] in seconds. Raises ``LogError`` for one beyond all clocks."""
    SECONDS.check(abs(stamp) / NANOSECONDS, "a stamp lies")
    return stamp / NANOSECONDS


EMPTY = " without a value"
"""Ending of a kind of messages of which some told nothing, in ``LogSource.skipped``."""
NO_VALUE = "no number, or a rotation of nothing but zeros"
"""Said of what tells no pose: programs send it while they do not know."""

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Sample:
    """One message of a log.

    ``time`` is the sensor's own stamp [s], the log time where the stamp is zero or there is none; ``logged`` the time
    at which it was written [s]. ``frame`` names the coordinate frame that the content is in (``laser_link``), empty
    where the log has none; ``child`` the moving frame of a pose (``base_link``). ``unstamped`` says that the stamp is
    zero. ``moment`` numbers the views of a log that knows them, in their order; samples of one moment make one view,
    whatever their times. −1: sensors are paired by time.
    """

    topic: str
    time: float
    logged: float
    frame: str
    content: Content
    child: str = ""
    unstamped: bool = False
    moment: int = -1


class LogSource(Protocol):
    """An open log. Reading it again gives the same samples in the same order."""

    @property
    def path(self) -> Path:
        """The file or folder."""
        ...

    @property
    def kind(self) -> str:
        """Name of the kind of log, as its ``LogKind`` has it."""
        ...

    @property
    def channels(self) -> tuple[Channel, ...]:
        """All topics in the log, those that nothing is read from among them; sorted by topic."""
        ...

    @property
    def metadata(self) -> Mapping[str, str]:
        """Notes in the log on how it was made."""
        ...

    @property
    def complete(self) -> bool:
        """False once reading has met the end of a log that was cut off, or a part of it that is damaged."""
        ...

    @property
    def damage(self) -> str:
        """The reason why the log is not complete, in a few words; empty where it is."""
        ...

    @property
    def skipped(self) -> Mapping[str, int]:
        """Messages or lines that are not read, counted by kind (schema)."""
        ...

    @property
    def unreadable(self) -> Mapping[str, Unreadable]:
        """Messages that are not what their type says, by topic, as far as the log was last read; they are left out."""
        ...

    @property
    def has_moments(self) -> bool:
        """True where the log itself says which samples belong to one view, by ``Sample.moment``."""
        ...

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Samples of the topics asked for, by default of all whose role is not ``IGNORED``, in the order of the log.

        May be called as often as one likes. Where the log was cut off, the samples end there and ``complete`` becomes
        False; a message or line that does not fit its type is left out, and counted as ``unreadable``. Raises
        ``LogError`` for a log that holds more than it may.
        """
        ...


@dataclass(frozen=True, slots=True)
class LogKind:
    """One kind of log: ``name`` for messages ('a CARMEN log'), its test by content, and its opener.

    ``recognises`` looks at a file or a folder and must be cheap; ``open`` raises ``LogError`` where the log cannot be
    read at all. Both import what they need when they are called, so that a library costs nothing before its kind of
    log is met.
    """

    name: str
    recognises: Callable[[Path], bool]
    open: Callable[[Path], LogSource]
