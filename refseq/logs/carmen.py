"""CARMEN text logs, plain or compressed: one message a line, fields apart by spaces, metres, radians and seconds.

Read are one laser, ODOM, TRUEPOS and PARAM. The laser is the front one (FLASER, ROBOTLASER1, RAWLASER1); in a log that
has none it is the rear one (RLASER, ROBOTLASER2, RAWLASER2), or else the first of RAWLASER3 to 5. Other kinds are
counted and passed over: a view has one scan, an IMU measures no way, and a position without a heading (NMEAGGA) is no
pose. The layouts are those of CARMEN's logger.
"""

import bz2
import gzip
import math
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, cast

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.files import naming_writes, open_input, replace_text
from refseq.intake import check_angles
from refseq.limits import BEAMS, LINE_BYTES, MESSAGES, UNPACKED_TEXT
from refseq.logs.closing import noted_damage
from refseq.logs.source import Channel, Role, Sample
from refseq.planar import Pose, after_motion, in_world, relative_pose
from refseq.view import LASER, Scan, View

NO_RETURN = 81.83
"""Ranges from here on mean 'nothing came back': the LMS 200's first error code in centimetre mode [m]."""

LONG_RANGE = 83.0
"""A laser that says it sees farther than this [m] is no LMS 200, and has no such codes: a choice, above 81.92."""

HALF_DEGREE = math.pi / 360


@dataclass(frozen=True, slots=True)
class _CarmenLine:
    """The fields of one line, with its place for messages; one that is not ``ended`` may have been cut off."""

    path: Path
    number: int
    fields: Sequence[str]
    ended: bool = True

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
    """State of the reader: all that was read so far and concerns the scans to come.

    A true pose holds where the odometer stood as ``at_truth`` says.
    """

    odometry: Pose | None = None
    truth: Pose | None = None
    at_truth: Pose | None = None

    def truth_at(self, odometry: Pose | None) -> Pose | None:
        """The true pose where the odometer shows this one; without an odometer it is that of the next scan only."""
        truth = self.truth
        if truth is None:
            return None
        if odometry is None or self.at_truth is None:
            self.truth = None  # who knows where the robot is by the next one
            return truth
        moved = relative_pose(odometry, self.at_truth)
        x, y = in_world((moved.x, moved.y), truth).tolist()
        return Pose(x, y, truth.heading + moved.heading)


@dataclass(frozen=True, slots=True)
class _LaserLine:
    """A line of the laser: its time [s] and that of the logger, its scan, and the poses that hold with it."""

    time: float
    logged: float
    scan: Scan
    odometry: Pose | None
    truth: Pose | None


LASERS = (
    ("FLASER", "ROBOTLASER1", "RAWLASER1"),
    ("RLASER", "ROBOTLASER2", "RAWLASER2"),
    ("RAWLASER3",),
    ("RAWLASER4",),
    ("RAWLASER5",),
)
"""Kinds of lines of each laser; the first that a log has is read."""
SCANS = tuple(kind for kinds in LASERS for kind in kinds)
REAR = LASERS[1]
"""Kinds of the rear laser: its beams are turned by π, and the pose beside them is its own."""
REACH = "robot_front_laser_max"
"""Parameter with the range of the laser [m], which FLASER has no place for."""
LASER_TOPIC, ODOMETRY_TOPIC, TRUTH_TOPIC = f"/{LASER}", "/odometry", "/truth"


@dataclass(frozen=True, slots=True)
class LineSpan:
    """Numbers of lines, from 1: ``first`` to ``last``, both among them, and the ``poses`` before that still hold."""

    first: int
    last: int
    poses: frozenset[int]

    def __contains__(self, number: int) -> bool:
        return self.first <= number <= self.last or number in self.poses


class CarmenSource:
    """A laser's scans of a CARMEN log, each a moment of its own with the poses in or before its line.

    The truth is TRUEPOS, carried on by the odometer, where the log has such lines; else the pose that the log itself
    corrected (the front laser's pose in FLASER and ROBOTLASER1). The odometer's pose is in the line too, or the last
    ODOM.
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
                if len(line.fields) < 3 and not line.ended:
                    break  # cut off
                if len(line.fields) < 3:
                    raise line.error(f"has {len(line.fields)} fields; valid are at least 3: PARAM, a name and a value")
                told[line.fields[1]] = line.fields[2]
        self.metadata = told
        self._kinds = next((kinds for kinds in LASERS if any(self._counts[kind] for kind in kinds)), ())
        self._reach = _reach(told)
        if not self._scans:
            seen = _some(sorted(self.skipped))
            why = f"is text, so a CARMEN log, and holds no scan (kinds of lines seen: {seen})"
            raise LogError(f"{path}: {why}; valid are {', '.join(SCANS)}")

    @property
    def complete(self) -> bool:
        """False for a log that was cut off, and for one made of a drive that ended before its time."""
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
        return sum(self._counts[kind] for kind in self._kinds)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The laser, the poses beside its scans, and all other kinds of lines."""
        schema = "+".join(kind for kind in self._kinds if self._counts[kind])
        posed = [
            Channel(topic, schema, TEXT, self._scans, role)
            for topic, role in ((LASER_TOPIC, Role.LASER), (ODOMETRY_TOPIC, Role.ODOMETRY), (TRUTH_TOPIC, Role.TRUTH))
        ]
        others = (Channel(kind, kind, TEXT, count, Role.IGNORED) for kind, count in self.skipped.items())
        return tuple(sorted([*posed, *others], key=lambda channel: channel.topic))

    @property
    def skipped(self) -> Mapping[str, int]:
        """Lines of other kinds."""
        return {kind: count for kind, count in self._counts.items() if kind not in {*self._kinds, *POSES, "PARAM"}}

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Scans and their poses. Raises ``LogError`` with file and line for a line that does not fit its kind."""
        state = _State()
        moment = 0
        for line in self._readable():
            try:
                found = self._read_line(line, state)
            except LogError:
                if line.ended:
                    raise
                self._cut = f"line {line.number} is cut off"
                return
            if found is not None:
                for topic, content in (
                    (LASER_TOPIC, found.scan),
                    (ODOMETRY_TOPIC, found.odometry),
                    (TRUTH_TOPIC, found.truth),
                ):
                    if content is not None and (topics is None or topic in topics):
                        yield Sample(topic, found.time, found.logged, "", content, moment=moment)
                moment += 1

    def lines_of(self, first: int, last: int) -> LineSpan:
        """Lines of the scans ``first`` to ``last``, counted from 0, of all between, and of the poses that hold then.

        The order of the lines tells, for a logger's clock may be another than the stamps', or stand still.
        """
        poses: dict[str, int] = {}
        begin = end = scans = 0
        for line in self._readable():
            if line.kind in POSES and not begin:
                poses[line.kind] = line.number
            if line.kind not in self._kinds:
                continue
            if scans == first:
                begin = line.number
            elif not begin and line.kind.startswith("RAW") and "ODOM" not in poses:
                poses.pop("TRUEPOS", None)  # it was that scan's
            end, scans = line.number, scans + 1
            if scans > last:
                break
        return LineSpan(begin, end, frozenset(poses.values()))

    def _read_line(self, line: _CarmenLine, state: _State) -> _LaserLine | None:
        """Take one line into the state; a line of the laser is returned."""
        if line.kind in POSES:
            line.expect(10)
            values = line.floats(1, 7)
            if line.kind == "ODOM":
                state.odometry = _pose(values[:3])
            else:
                state.truth, state.at_truth = _pose(values[:3]), _pose(values[3:])
            return None
        if line.kind not in self._kinds:
            return None
        found = self._laser(line, state)
        if line.kind in REAR:
            found = replace(found, scan=replace(found.scan, start=found.scan.start + math.pi), truth=None)
        if self._counts["TRUEPOS"]:
            found = replace(found, truth=state.truth_at(found.odometry))
        return found

    def _laser(self, line: _CarmenLine, state: _State) -> _LaserLine:
        """A line of the laser by itself."""
        if line.kind in ("FLASER", "RLASER"):
            return _flaser(line, self._reach)
        return _robotlaser(line) if line.kind.startswith("ROBOT") else _rawlaser(line, state)


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
    for number, text in enumerate(text_lines(path), 1):
        fields = text.decode("utf-8", errors="replace").split()
        if fields and not fields[0].startswith("#"):
            yield _CarmenLine(path, number, fields, text.endswith(b"\n"))


def text_lines(path: Path) -> Iterator[bytes]:
    """All lines, as they are. Raises ``CutOffError`` where compressed data end before their time."""
    unpacked, lines = UNPACKED_TEXT.of(path), MESSAGES.of(path)
    with _opened(path) as file:
        for number, text in enumerate(iter(lambda: _next_line(file), b""), 1):
            LINE_BYTES.check(len(text), f"{path}: line {number}: has")
            unpacked.add(len(text))
            lines.add(1)
            yield text


def _next_line(file: IO[bytes]) -> bytes:
    try:
        return file.readline(LINE_BYTES + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise CutOffError(str(error) or "compressed data end") from error
    except OSError as error:
        if error.errno is None:  # bz2 has no error of its own for damaged data
            raise CutOffError(str(error)) from error
        raise


def _reach(told: Mapping[str, str]) -> float:
    """The range of FLASER's laser [m]; what is no range is not looked at, since any log may hold it."""
    try:
        found = float(told.get(REACH, NO_RETURN))
    except ValueError:
        return NO_RETURN
    return found if 0 < found <= NO_RETURN else NO_RETURN


def _flaser(line: _CarmenLine, reach: float) -> _LaserLine:
    n = line.count(1)
    line.expect(n + 11, n)
    _check_angles(line, n, -math.pi / 2, _flaser_step(n))
    truth, odometry = line.floats(n + 2, n + 5), line.floats(n + 5, n + 8)
    scan = _scan(line.floats(2, n + 2), -math.pi / 2, _flaser_step(n), reach)
    return _timed(line, n + 8, scan, truth=_pose(truth), odometry=_pose(odometry))


def _laser_head(line: _CarmenLine) -> tuple[Scan, int]:
    """The part that RAWLASER and ROBOTLASER share: the scan, and the index of the field behind the remissions."""
    n = line.count(8)
    start, _, step, max_range = line.floats(2, 6)
    behind_ranges = 9 + n
    if len(line.fields) <= behind_ranges:
        raise line.error(f"has {len(line.fields)} fields; valid are at least {behind_ranges + 1} for {n} ranges")
    remissions = line.count(behind_ranges)
    _check_angles(line, n, float(start), float(step))
    scan = _scan(line.floats(9, behind_ranges), float(start), float(step), float(max_range))
    return scan, behind_ranges + 1 + remissions


def _check_angles(line: _CarmenLine, count: int, start: float, step: float) -> None:
    """Raise ``LogError`` for a line whose beams are at no angles of a scanner."""
    try:
        check_angles(count, start, step, LogError)
    except LogError as error:
        raise line.error(str(error)) from error


def _robotlaser(line: _CarmenLine) -> _LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 14, len(scan.ranges))
    poses = line.floats(at, at + 6)
    return _timed(line, at + 11, scan, truth=_pose(poses[:3]), odometry=_pose(poses[3:]))


def _rawlaser(line: _CarmenLine, state: _State) -> _LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 3, len(scan.ranges))
    return _timed(line, at, scan, truth=None, odometry=state.odometry)


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
    if not max_range > 0:  # not told
        max_range = NO_RETURN
    limit = max_range if max_range > LONG_RANGE else min(max_range, NO_RETURN)
    seen = np.where(ranges < limit, ranges, np.inf).astype(np.float32)
    return Scan(seen, start, step, limit)


def write_carmen(path: Path | str, views: Sequence[View], metadata: Mapping[str, str] | None = None) -> None:
    """Write the scans of ``views`` as a CARMEN log, replacing ``path`` in one step.

    A view whose true pose and odometry are known is a FLASER line, which has no angles; for scans of other angles or
    another range than it stands for, ROBOTLASER1. Both have places for both poses, so that others are RAWLASER1 lines
    with an ODOM line before them, or TRUEPOS: what nobody measured is not made up, and read again it is not there.

    Images have no place in the format, nor spaces and line ends in a metadata value: they become underscores. The
    odometer pose is the sum of the views' motions from the first one's truth. Raises ``LogError`` when no view has a
    scan, and when the file cannot be written.
    """
    path = Path(path)
    scans = [view.scan for view in views if view.scan is not None]
    if not scans:
        raise LogError(f"{path}: a CARMEN log holds laser scans; none of the {len(views)} views has one")
    reach = float(scans[0].max_range)
    told = dict(metadata or {}) | ({REACH: f"{reach:g}"} if float(f"{reach:g}") == reach < NO_RETURN else {})
    words = {name: "_".join(value.split()) for name, value in told.items()}
    lines = [f"PARAM {name} {word} 0 refseq 0" for name, word in words.items() if word]
    measured = any(view.has_odometry for view in views)
    odometry = next((view.truth for view in views if view.scan is not None), None) or Pose(0.0, 0.0, 0.0)
    for index, view in enumerate(views):
        if index:
            odometry = after_motion(odometry, view.distance, view.turn)
        if view.scan is not None:
            lines += _laser_lines(view, view.scan, odometry if measured else None, _reach(words))
    with naming_writes(path, LogError):
        replace_text(path, "\n".join(lines) + "\n")


def _laser_lines(view: View, scan: Scan, odometry: Pose | None, reach: float) -> list[str]:
    """A scan and the poses that are known with it; ``reach`` [m] is what FLASER stands for."""
    ranges, stamps = _ranges_text(scan), f"{view.time:.6f} refseq {view.time:.6f}"
    if view.truth is not None and odometry is not None:
        poses = f"{_pose_text(view.truth)} {_pose_text(odometry)}"
        if _as_flaser_says(scan, reach):
            return [f"FLASER {ranges} {poses} {stamps}"]
        return [f"ROBOTLASER1 {_head_text(scan)} {ranges} 0 {poses} 0 0 0 0 0 {stamps}"]
    known = [f"TRUEPOS {_pose_text(view.truth)} 0 0 0 {stamps}"] if view.truth is not None else []
    known += [f"ODOM {_pose_text(odometry)} 0 0 0 {stamps}"] if odometry is not None else []
    return [*known, f"RAWLASER1 {_head_text(scan)} {ranges} 0 {stamps}"]


def _ranges_text(scan: Scan) -> str:
    """The number of ranges and each, in millimetres' steps; what came back is never rounded to what did not."""
    nothing = max(scan.max_range, NO_RETURN)
    limit = scan.max_range if scan.max_range > LONG_RANGE else min(scan.max_range, NO_RETURN)
    below = math.ceil(limit * 1000 - 1e-6) / 1000 - 0.001
    ranges = scan.ranges.astype(np.float64)
    reach = np.where(ranges < limit, np.minimum(np.round(ranges, 3), below), nothing)
    return f"{len(reach)} {' '.join(f'{r:.3f}'.rstrip('0').rstrip('.') for r in reach)}"


def _pose_text(pose: Pose) -> str:
    return f"{pose.x:.6f} {pose.y:.6f} {pose.heading:.6f}"


def _head_text(scan: Scan) -> str:
    width = scan.step * (len(scan.ranges) - 1)
    return f"0 {scan.start:.9f} {width:.9f} {scan.step:.9f} {scan.max_range:g} 0.01 0"


def _flaser_step(n: int) -> float:
    """FLASER has no angles: 360 beams and more come every half degree, fewer every degree [rad]."""
    return HALF_DEGREE if n >= 360 else 2 * HALF_DEGREE


def _as_flaser_says(scan: Scan, reach: float) -> bool:
    """True where a reader of FLASER takes each beam for the direction that it has, within a tenth of a step."""
    if abs(scan.max_range - reach) > 1e-6:
        return False
    n, step = len(scan.ranges), _flaser_step(len(scan.ranges))
    farthest = abs(scan.start + math.pi / 2) + abs(scan.step - step) * n
    return farthest < step / 10
