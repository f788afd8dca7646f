"""Kinds of lines: what each holds, in which fields."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.intake import check_angles
from refseq.limits import SECONDS
from refseq.logs.carmen.line import CarmenLine
from refseq.planar import Pose
from refseq.view import Scan

NO_RETURN = 81.83
"""Ranges from here on mean 'nothing came back': the LMS 200's first error code in centimetre mode [m]."""

LONG_RANGE = 83.0
"""A laser that says it sees farther than this [m] is no LMS 200, and has no such codes: a choice, above 81.92."""

HALF_DEGREE = math.pi / 360

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


@dataclass(frozen=True, slots=True)
class LaserLine:
    """A line of the laser: its time [s] and that of the logger, its scan, and the poses that hold with it."""

    time: float
    logged: float
    scan: Scan
    odometry: Pose | None
    truth: Pose | None


def reach_told(told: Mapping[str, str]) -> float:
    """The range of FLASER's laser [m]; what is no range is not looked at, since any log may hold it."""
    try:
        found = float(told.get(REACH, NO_RETURN))
    except ValueError:
        return NO_RETURN
    return found if 0 < found <= NO_RETURN else NO_RETURN


def least_unseen(max_range: float) -> float:
    """The range from which on nothing came back to a laser of this range [m]."""
    return max_range if max_range > LONG_RANGE else min(max_range, NO_RETURN)


def flaser_step(n: int) -> float:
    """FLASER has no angles: 360 beams and more come every half degree, fewer every degree [rad]."""
    return HALF_DEGREE if n >= 360 else 2 * HALF_DEGREE


def read_laser(line: CarmenLine, reach: float) -> LaserLine:
    """Read a line of a laser; ``reach`` [m] is FLASER's. Raises ``LogError`` for one that does not fit its kind."""
    if line.kind in ("FLASER", "RLASER"):
        found = _flaser(line, reach)
    else:
        found = _robotlaser(line) if line.kind.startswith("ROBOT") else _rawlaser(line)
    if line.kind not in REAR:
        return found
    return replace(found, scan=replace(found.scan, start=found.scan.start + math.pi), truth=None)


def read_poses(line: CarmenLine) -> tuple[Pose, Pose]:
    """Read ODOM or TRUEPOS: its first pose, and the one behind, TRUEPOS's odometer. Raises ``LogError`` as above."""
    line.expect(10)
    return line.pose(1), line.pose(4)


def _flaser(line: CarmenLine, reach: float) -> LaserLine:
    n = line.count(1)
    line.expect(n + 11, n)
    check_angles(n, -math.pi / 2, flaser_step(n), LogError)
    scan = _scan(line.floats(2, n + 2), -math.pi / 2, flaser_step(n), reach)
    return _timed(line, n + 8, scan, truth=line.pose(n + 2), odometry=line.pose(n + 5))


def _laser_head(line: CarmenLine) -> tuple[Scan, int]:
    """The part that RAWLASER and ROBOTLASER share: the scan, and the index of the field behind the remissions."""
    n = line.count(8)
    start, _, step, max_range = line.floats(2, 6)
    behind_ranges = 9 + n
    if len(line.fields) <= behind_ranges:
        raise LogError(f"has {len(line.fields)} fields; valid are at least {behind_ranges + 1} for {n} ranges")
    remissions = line.count(behind_ranges)
    check_angles(n, float(start), float(step), LogError)
    scan = _scan(line.floats(9, behind_ranges), float(start), float(step), float(max_range))
    return scan, behind_ranges + 1 + remissions


def _robotlaser(line: CarmenLine) -> LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 14, len(scan.ranges))
    return _timed(line, at + 11, scan, truth=line.pose(at), odometry=line.pose(at + 3))


def _rawlaser(line: CarmenLine) -> LaserLine:
    scan, at = _laser_head(line)
    line.expect(at + 3, len(scan.ranges))
    return _timed(line, at, scan, truth=None, odometry=None)


def _timed(line: CarmenLine, at: int, scan: Scan, *, truth: Pose | None, odometry: Pose | None) -> LaserLine:
    """The line's data; its time is field ``at``, the logger's its last."""
    time = float(line.floats(at, at + 1, SECONDS)[0])
    try:
        logged = float(line.fields[-1])
    except ValueError:
        logged = time
    if not abs(logged) <= SECONDS:
        logged = time
    return LaserLine(time, logged, scan, odometry, truth)


def _scan(ranges: NDArray[np.float64], start: float, step: float, max_range: float) -> Scan:
    if not max_range > 0:  # not told
        max_range = NO_RETURN
    limit = least_unseen(max_range)
    seen = np.where(ranges < limit, ranges, np.inf).astype(np.float32)
    return Scan(seen, start, step, limit)
