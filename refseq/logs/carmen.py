"""CARMEN text logs: one message a line, fields apart by spaces, metres, radians and seconds.

Read are the front laser (FLASER, ROBOTLASER1, RAWLASER1), ODOM, TRUEPOS and PARAM; other kinds, the rear laser among
them, are counted and passed over. The layouts are those of CARMEN's logger.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.files import replace_text
from refseq.logs.recording import Recording, TimedData, views_of
from refseq.planar import Pose, after_motion
from refseq.view import Scan, View

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
        return LogError(f"{self.path}: line {self.number}: {self.kind}: {what}")

    def floats(self, start: int, stop: int) -> NDArray[np.float64]:
        try:
            values = np.array(self.fields[start:stop], dtype=float)
        except ValueError as error:
            raise self.error(f"{error}; valid are numbers in fields {start} to {stop - 1}") from error
        if not np.isfinite(values).all():
            bad = int(np.flatnonzero(~np.isfinite(values))[0])
            raise self.error(f"field {start + bad} is {self.fields[start + bad]}; valid are finite numbers")
        return values

    def count(self, index: int) -> int:
        """The whole number in field ``index``, which says how many values follow."""
        if len(self.fields) <= index or not self.fields[index].isdecimal():
            found = self.fields[index] if len(self.fields) > index else "nothing"
            raise self.error(f"field {index} is {found}; valid is the number of ranges")
        return int(self.fields[index])

    def expect(self, length: int, ranges: int | None = None) -> None:
        if len(self.fields) != length:
            why = "" if ranges is None else f" for {ranges} ranges"
            raise self.error(f"has {len(self.fields)} fields; valid are {length}{why}")


@dataclass(slots=True)
class _State:
    """State of the reader: all that was read so far and concerns the scans to come."""

    odometry: Pose | None = None
    truth: Pose | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)


def read_carmen(path: Path) -> Recording:
    """Read the front laser's scans of a CARMEN log as views.

    A view's truth is the pose that the log itself corrected (FLASER's and ROBOTLASER1's laser pose) or the last
    TRUEPOS; its motion comes from the odometer pose. Raises ``LogError`` with file and line for a line whose count of
    fields does not fit, for a value that is no number, and when there is no scan.
    """
    state = _State()
    scans = [scan for line in _lines(path) if (scan := _read_line(line, state)) is not None]
    if not scans:
        seen = _some(sorted(state.skipped))
        raise LogError(f"{path}: holds no scan (kinds of lines seen: {seen}); valid are FLASER, ROBOTLASER1, RAWLASER1")
    return Recording(tuple(views_of(scans)), state.metadata, skipped=state.skipped)


def _some(kinds: Sequence[str], most: int = 5) -> str:
    """The first few kinds, shortened: a text that is no log has as many as it has lines."""
    named = [f"{kind:.20}" for kind in kinds[:most]] + ([f"and {len(kinds) - most} more"] if len(kinds) > most else [])
    return ", ".join(named) or "none"


def _lines(path: Path) -> Iterator[_CarmenLine]:
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, text in enumerate(file, start=1):
            fields = text.split()
            if fields and not fields[0].startswith("#"):
                yield _CarmenLine(path, number, fields)


def _read_line(line: _CarmenLine, state: _State) -> TimedData | None:
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
        case "PARAM":
            if len(line.fields) < 3:
                raise line.error(f"has {len(line.fields)} fields; valid are at least 3: PARAM, a name and a value")
            state.metadata[line.fields[1]] = line.fields[2]
        case kind:
            state.skipped[kind] = state.skipped.get(kind, 0) + 1
    return None


def _flaser(line: _CarmenLine) -> TimedData:
    n = line.count(1)
    line.expect(n + 11, n)
    truth, odometry = line.floats(n + 2, n + 5), line.floats(n + 5, n + 8)
    # The message has no angles: 360 beams and more come every half degree, fewer every degree.
    step = HALF_DEGREE if n >= 360 else 2 * HALF_DEGREE
    scan = _scan(line.floats(2, n + 2), -math.pi / 2, step, NO_RETURN)
    return _timed(line.floats(n + 8, n + 9), scan, truth=_pose(truth), odometry=_pose(odometry))


def _laser_head(line: _CarmenLine) -> tuple[Scan, int]:
    """The part that RAWLASER and ROBOTLASER share: the scan, and the index of the field behind the remissions."""
    n = line.count(8)
    start, _, step, max_range = line.floats(2, 6)
    behind_ranges = 9 + n
    if len(line.fields) <= behind_ranges:
        raise line.error(f"has {len(line.fields)} fields; valid are at least {behind_ranges + 1} for {n} ranges")
    remissions = line.count(behind_ranges)
    scan = _scan(line.floats(9, behind_ranges), float(start), float(step), float(max_range))
    return scan, behind_ranges + 1 + remissions


def _robotlaser(line: _CarmenLine) -> TimedData:
    scan, at = _laser_head(line)
    line.expect(at + 14, len(scan.ranges))
    poses = line.floats(at, at + 6)
    return _timed(line.floats(at + 11, at + 12), scan, truth=_pose(poses[:3]), odometry=_pose(poses[3:]))


def _rawlaser(line: _CarmenLine, state: _State) -> TimedData:
    scan, at = _laser_head(line)
    line.expect(at + 3, len(scan.ranges))
    return _timed(line.floats(at, at + 1), scan, truth=state.truth, odometry=state.odometry)


def _timed(time: NDArray[np.float64], scan: Scan, *, truth: Pose | None, odometry: Pose | None) -> TimedData:
    return TimedData(float(time[0]), scan=scan, odometry=odometry, truth=truth)


def _pose(values: NDArray[np.float64]) -> Pose:
    return Pose(*values.tolist())


def _scan(ranges: NDArray[np.float64], start: float, step: float, max_range: float) -> Scan:
    limit = min(max_range, NO_RETURN)
    seen = np.where(ranges < limit, ranges, np.inf).astype(np.float32)
    return Scan(seen, start, step, limit)


def write_carmen(path: Path, views: Sequence[View], metadata: Mapping[str, str] | None = None) -> None:
    """Write the scans of ``views`` as a CARMEN log of FLASER lines, replacing ``path`` in one step.

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
            lines.append(_flaser_text(view, view.scan, odometry))
    replace_text(path, "\n".join(lines) + "\n")


def _flaser_text(view: View, scan: Scan, odometry: Pose) -> str:
    reach = np.where(np.isfinite(scan.ranges), scan.ranges, NO_RETURN)
    ranges = " ".join(f"{r:.2f}" for r in reach)
    truth = view.truth or odometry
    poses = " ".join(f"{value:.6f}" for p in (truth, odometry) for value in (p.x, p.y, p.heading))
    return f"FLASER {len(reach)} {ranges} {poses} {view.time:.6f} refseq {view.time:.6f}"
