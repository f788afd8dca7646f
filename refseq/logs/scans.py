"""Laser scans of any make, brought to one form: counter-clockwise, metres, ``inf`` where nothing came back."""

import math
from collections.abc import Iterable, Sequence, Sized

import numpy as np
from numpy.typing import ArrayLike

from refseq.errors import LogError
from refseq.intake import check_angles
from refseq.logs.transforms import Mount
from refseq.view import Scan, facing


def scan_of(
    ranges: ArrayLike,
    start: float,
    step: float,
    min_range: float = 0.0,
    max_range: float | None = None,
) -> Scan:
    """A scan from the fields that all messages have: ``start`` and ``step`` [rad], ranges [m].

    A range that is no number, not above ``min_range`` or at ``max_range`` or beyond came from nowhere: ``inf``. A
    negative step, of a scanner that turns clockwise or hangs upside down, is turned round. A ``max_range`` that is
    None, or not positive and finite, is not told: no range is too far then. Raises ``LogError`` for angles that are
    none.
    """
    count = len(ranges) if isinstance(ranges, Sized) else 1
    check_angles(count, start, step, LogError)
    with np.errstate(over="ignore"):  # a range beyond all floats is none
        seen = np.array(ranges, dtype=np.float32).reshape(-1)
    reach = max_range if max_range is not None and math.isfinite(max_range) and max_range > 0 else None
    with np.errstate(invalid="ignore"):
        seen[~((seen > max(0.0, min_range)) & (seen < (np.inf if reach is None else reach)))] = np.inf
    return facing(Scan(seen, start, step) if reach is None else Scan(seen, start, step, reach))


FARTHEST = 250.0
"""No laser has half of its ranges beyond [m]."""


def range_doubt(scans: Iterable[Scan]) -> str:
    """A sentence for ranges that are no laser's in metres; empty for others."""
    # Those from beyond its greatest range as well: that may be in metres where they are not.
    ranges = np.concatenate([np.zeros(0), *(scan.ranges[np.isfinite(scan.ranges)] for scan in scans)])
    usual = float(np.median(ranges)) if len(ranges) else 0.0
    return f"half of its ranges are beyond {usual:.0f} m: are they in metres?" if usual > FARTHEST else ""


FEW = 0.02
"""A scan of which no larger share of the beams came back shows nothing: 0.68 is the least in the logs of others."""


def return_doubt(scans: Sequence[Scan]) -> str:
    """A sentence for a laser that is said to see less far than its ranges are; empty for others."""
    shares = [scan.returned.mean() for scan in scans if len(scan.ranges)]
    if not shares or np.median(shares) > FEW:
        return ""
    farthest = max(scan.max_range for scan in scans)
    return f"half of its scans show nothing within {farthest:.0f} m: are its ranges in metres?"


def mounted(scan: Scan, mount: Mount | None) -> Scan:
    """The scan with bearings from the robot's forward direction; the laser's place on the robot stays its origin."""
    if mount is None or (mount.yaw == 0 and not mount.upside_down):
        return scan
    ranges, start = scan.ranges, scan.start
    if mount.upside_down:  # what the scanner takes for left is right
        ranges, start = ranges[::-1].copy(), -(scan.start + scan.step * (len(ranges) - 1))
    return facing(Scan(ranges, start + mount.yaw, scan.step, scan.max_range))
