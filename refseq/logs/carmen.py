"""CARMEN text logs, plain or compressed: one message a line, fields apart by spaces, metres, radians and seconds.

Read are the front laser (FLASER, ROBOTLASER1, RAWLASER1), ODOM, TRUEPOS and PARAM; other kinds, the rear laser among
them, are counted and passed over. The layouts are those of CARMEN's logger.
"""

import bz2
import gzip
import math
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, cast

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.files import open_input, replace_text
from refseq.limits import BEAMS, LINE_BYTES, MESSAGES, UNPACKED_TEXT
from refseq.logs.closing import noted_damage
from refseq.logs.scans import check_angles
from refseq.logs.source import Channel, Role, Sample
from refseq.planar import Pose, after_motion
from refseq.view import LASER, Scan, View

NO_RETURN = 81.83
"""Ranges from here on mean 'nothing came back': the LMS 200's first error code in centimetre mode [m]."""

HALF_DEGREE = math.pi / 360


@dataclass(frozen=True, slots=True)
class _CarmenLine:
    """The fields of one line, with its place for messages."""

    path: Path
    number: int
    fields: Sequence[str]

    @property
    def kind(self) -> str:
        return self.fields[0]

    def error(self, what: str) -> LogError:
        return LogError(f"{self.path}: line {self.number}: {self.kind:.40}: {what}")

    def floats(self, start: int, stop: int) -> NDArray[np.float64]:
        try:
            values = np.array(self.fields[start:stop], dtype=float)
        except ValueError as error:
            raise self.error(f"{error!s:.200}; valid are numbers in fields {start} to {stop - 1}") from error
        if not (wrong := ~(np.abs(values) <= MOST)).any():
            return values
        bad = int(np.flatnonzero(wrong)[0])
        raise self.error(
            f"field {start + bad} is {self.fields[start + bad]:.40}; valid are finite numbers up to {MOST:g}"
        )

    def count(self, index: int) -> int:
        """The whole number in field ``index``, which says how many values follow."""
        found = self.fields[index] if len(self.fields) > index else "nothing"
        if not (found.isascii() and found.isdecimal() and len(found) <= LONGEST_COUNT):
            raise self.error(f"field {index} is {found:.40}; valid is the number of ranges")
        BEAMS.check(int(found), f"{self.path}: line {self.number}: {self.kind}: has")
        return int(found)

    def expect(self, length: int, ranges: int | None = None) -> None:
        if len(self.fields) != length:
            why = "" if ranges is None else f" for {ranges} ranges"
            raise self.error(f"has {len(self.fields)} fields; valid are {length}{why}")


@dataclass(slots=True)
class _State:
    """State of the reader: all that was read so far and concerns the scans to come."""

    odometry: Pose | None = None
    truth: Pose | None = None


@dataclass(frozen=True, slots=True)
class _LaserLine:
    """A line of the front laser: its time [s] and that of the logger, its scan, and the poses that hold with it."""

    time: float
    logged: float
    scan: Scan
    odometry: Pose | None
    truth: Pose | None


SCANS = ("FLASER", "ROBOTLASER1", "RAWLASER1")
LASER_TOPIC, ODOMETRY_TOPIC, TRUTH_TOPIC = f"/{LASER}", "/odometry", "/truth"


class CarmenSource:
    """The front laser's scans of a CARMEN log, each a moment of its own with the poses in or before its line.

    The truth is the pose that the log itself corrected (FLASER's and ROBOTLASER1's laser pose) or the last TRUEPOS; the
    odometer's pose is in the line too, or the last ODOM.
    """

    kind = "a CARMEN log"
    has_moments = True

    def __init__(self, path: Path) -> None:
        self.path = path
        self._cut = ""
        self._counts: Counter[str] = Counter()
        self.metadata: Mapping[str, str] = {}
        told: dict[str, str] = {}
        for line in self._readable():
            self._counts[line.kind] += 1
            if line.kind == "PARAM":
                if len(line.fields) < 3:
                    raise line.error(f"has {len(line.fields)} fields; valid are at least 3: PARAM, a name and a value")
                told[line.fields[1]] = line.fields[2]
        self.metadata = told
        if not self._scans:
            seen = _some(sorted(self.skipped))
            raise LogError(f"{path}: holds no scan (kinds of lines seen: {seen}); valid are {', '.join(SCANS)}")

    @property
    def complete(self) -> bool:
        """False for a compressed log that was cut off, and for one made of a drive that ended before its time."""
        return not self.damage

    @property
    def damage(self) -> str:
        """The reason why it is not complete; empty where it is."""
        return noted_damage(self.metadata) or self._cut

    def _readable(self) -> Iterator[_CarmenLine]:
        """The lines up to where the log is cut off."""
        try:
            yield from _lines(self.path)
        except CutOffError as error:
            self._cut = str(error)

    @property
    def _scans(self) -> int:
        return sum(self._counts[kind] for kind in SCANS)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The laser, the poses beside its scans, and all other kinds of lines."""
        schema = "+".join(kind for kind in SCANS if self._counts[kind])
        posed = [
            Channel(topic, schema, TEXT, self._scans, role)
            for topic, role in ((LASER_TOPIC, Role.LASER), (ODOMETRY_TOPIC, Role.ODOMETRY), (TRUTH_TOPIC, Role.TRUTH))
        ]
        others = (Channel(kind, kind, TEXT, count, Role.IGNORED) for kind, count in self.skipped.items())
        return tuple(sorted([*posed, *others], key=lambda channel: channel.topic))

    @property
    def skipped(self) -> Mapping[str, int]:
        """Lines of other kinds."""
        return {kind: count for kind, count in self._counts.items() if kind not in {*SCANS, *POSES, "PARAM"}}

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Scans and their poses. Raises ``LogError`` with file and line for a line that does not fit its kind."""
        state = _State()
        moment = 0
        for line in self._readable():
            found = _read_line(line, state)
            if found is not None:
                for topic, content in (
                    (LASER_TOPIC, found.scan),
                    (ODOMETRY_TOPIC, found.odometry),
                    (TRUTH_TOPIC, found.truth),
                ):
                    if content is not None and (topics is None or topic in topics):
                        yield Sample(topic, found.time, found.logged, "", content, moment=moment)
                moment += 1


class CutOffError(Exception):
    """Compressed data end or are damaged."""


MOST = 1e12
"""The largest number that is believed: times are below 2e9 s, places below 1e7 m."""
LONGEST_COUNT = 9
"""Digits of the largest number of ranges that is looked at."""

POSES = ("ODOM", "TRUEPOS")
TEXT = "text"


def is_carmen(path: Path) -> bool:
    """Tell whether a file is text that is not blank, compressed or not."""
    if not path.is_file():
        return False
    with _opened(path) as file:
        try:
            head = file.read(4096)
        except (EOFError, zlib.error, OSError):
            return False
    return b"\0" not in head and bool(head.strip())


def _some(kinds: Sequence[str], most: int = 5) -> str:
    """The first few kinds, shortened: a text that is no log has as many as it has lines."""
    named = [f"{kind:.20}" for kind in kinds[:most]] + ([f"and {len(kinds) - most} more"] if len(kinds) > most else [])
    return ", ".join(named) or "none"


def _opened(path: Path) -> IO[bytes]:
    """The file's text; of one that is compressed by gzip or bzip2, as its first bytes say, what it was before."""
    with open_input(path) as file:
        head = file.read(3)
    if head[:2] == b"\x1f\x8b":
        return cast(IO[bytes], gzip.open(path))
    return cast(IO[bytes], bz2.open(path)) if head == b"BZh" else path.open("rb")


def _lines(path: Path) -> Iterator[_CarmenLine]:
    """Lines that are neither blank nor comments. Raises ``CutOffError`` where compressed data end before their time."""
    number = 0
    unpacked, lines = UNPACKED_TEXT.of(path), MESSAGES.of(path)
    with _opened(path) as file:
        while text := _next_line(file):
            number += 1
            LINE_BYTES.check(len(text), f"{path}: line {number}: has")
            unpacked.add(len(text))
            lines.add(1)
            fields = text.decode("utf-8", errors="replace").split()
            if fields and not fields[0].startswith("#"):
                yield _CarmenLine(path, number, fields)


def _next_line(file: IO[bytes]) -> bytes:
    try:
        return file.readline(LINE_BYTES + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise CutOffError(str(error) or "compressed data end") from error
    except OSError as error:
        if error.errno is None:  # bz2 has no error of its own for damaged data
            raise CutOffError(str(error)) from error
        raise


def _read_line(line: _CarmenLine, state: _State) -> _LaserLine | None:
    """Take one line into the state; a line of the front laser is returned."""
    match line.kind:
        case "FLASER":
            return _flaser(line)
        case "ROBOTLASER1":
            return _robotlaser(line)
        case "RAWLASER1":
            return _rawlaser(line, state)
        case "ODOM":
            line.expect(10)
            state.odometry = _pose(line.floats(1, 4))
        case "TRUEPOS":
            line.expect(10)
            state.truth = _pose(line.floats(1, 4))
    return None


def _flaser(line: _CarmenLine) -> _LaserLine:
    n = line.count(1)
    line.expect(n + 11, n)
    truth, odometry = line.floats(n + 2, n + 5), line.floats(n + 5, n + 8)
    scan = _scan(line.floats(2, n + 2), -math.pi / 2, _flaser_step(n), NO_RETURN)
    return _timed(line, n + 8, scan, truth=_pose(truth), odometry=_pose(odometry))


def _laser_head(line: _CarmenLine) -> tuple[Scan, int]:
    """The part that RAWLASER and ROBOTLASER share: the scan, and the index of the field behind the remissions."""
    n = line.count(8)
    start, _, step, max_range = line.floats(2, 6)
    behind_ranges = 9 + n
    if len(line.fields) <= behind_ranges:
        raise line.error(f"has {len(line.fields)} fields; valid are at least {behind_ranges + 1} for {n} ranges")
    remissions = line.count(behind_ranges)
    try:
        check_angles(n, float(start), float(step))
    except LogError as error:
        raise line.error(str(error)) from error
    scan = _scan(line.floats(9, behind_ranges), float(start), float(step), float(max_range))
    return scan, behind_ranges + 1 + remissions


def _robotlaser(line: _CarmenLine) -> _LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 14, len(scan.ranges))
    poses = line.floats(at, at + 6)
    return _timed(line, at + 11, scan, truth=_pose(poses[:3]), odometry=_pose(poses[3:]))


def _rawlaser(line: _CarmenLine, state: _State) -> _LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 3, len(scan.ranges))
    return _timed(line, at, scan, truth=state.truth, odometry=state.odometry)


def _timed(line: _CarmenLine, at: int, scan: Scan, *, truth: Pose | None, odometry: Pose | None) -> _LaserLine:
    """The line's data; its time is field ``at``, the logger's its last."""
    time = float(line.floats(at, at + 1)[0])
    try:
        logged = float(line.fields[-1])
    except ValueError:
        logged = time
    if not abs(logged) <= MOST:
        logged = time
    return _LaserLine(time, logged, scan, odometry, truth)


def _pose(values: NDArray[np.float64]) -> Pose:
    return Pose(*values.tolist())


def _scan(ranges: NDArray[np.float64], start: float, step: float, max_range: float) -> Scan:
    limit = min(max_range, NO_RETURN)
    seen = np.where(ranges < limit, ranges, np.inf).astype(np.float32)
    return Scan(seen, start, step, limit)


def write_carmen(path: Path, views: Sequence[View], metadata: Mapping[str, str] | None = None) -> None:
    """Write the scans of ``views`` as a CARMEN log, replacing ``path`` in one step.

    Lines are FLASER, which has no angles; for scans of other angles than it stands for they are ROBOTLASER1.

    Images have no place in the format, nor spaces and line ends in a metadata value: they become underscores. The
    odometer pose is the sum of the views' motions from the first one's truth.
    Raises ``LogError`` when no view has a scan.
    """
    scanned = [view for view in views if view.scan is not None]
    if not scanned:
        raise LogError(f"{path}: a CARMEN log holds laser scans; none of the {len(views)} views has one")
    words = {name: "_".join(value.split()) for name, value in (metadata or {}).items()}
    lines = [f"PARAM {name} {word} 0 refseq 0" for name, word in words.items() if word]
    odometry = scanned[0].truth or Pose(0.0, 0.0, 0.0)
    for index, view in enumerate(views):
        if index:
            odometry = after_motion(odometry, view.distance, view.turn)
        if view.scan is not None:
            lines.append(_laser_text(view, view.scan, odometry))
    replace_text(path, "\n".join(lines) + "\n")


def _laser_text(view: View, scan: Scan, odometry: Pose) -> str:
    reach = np.where(np.isfinite(scan.ranges), scan.ranges, max(scan.max_range, NO_RETURN))
    ranges = " ".join(f"{r:.2f}" for r in reach)
    truth = view.truth or odometry
    poses = " ".join(f"{value:.6f}" for p in (truth, odometry) for value in (p.x, p.y, p.heading))
    stamps = f"{view.time:.6f} refseq {view.time:.6f}"
    if _as_flaser_says(scan):
        return f"FLASER {len(reach)} {ranges} {poses} {stamps}"
    width = scan.step * (len(reach) - 1)
    head = f"0 {scan.start:.9f} {width:.9f} {scan.step:.9f} {scan.max_range:g} 0.01 0"
    return f"ROBOTLASER1 {head} {len(reach)} {ranges} 0 {poses} 0 0 0 0 0 {stamps}"


def _flaser_step(n: int) -> float:
    """FLASER has no angles: 360 beams and more come every half degree, fewer every degree [rad]."""
    return HALF_DEGREE if n >= 360 else 2 * HALF_DEGREE


def _as_flaser_says(scan: Scan) -> bool:
    """True where a reader of FLASER takes each beam for the direction that it has, within a tenth of a step."""
    n, step = len(scan.ranges), _flaser_step(len(scan.ranges))
    farthest = abs(scan.start + math.pi / 2) + abs(scan.step - step) * n
    return farthest < step / 10
