"""Unit of a laser's ranges: the way that its scans show between two places against the odometer's.

Each scan is brought to one size by the median of the ranges of the one before, so that it is compared alike in any
unit. The way straight on that leaves least of it unexplained, told in the unit of the ranges, over the odometer's
metres is 1 for a laser in metres and 100 for one in centimetres. Places that do not tell how far the robot has come,
as in a bare corridor, do not count.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.health.likelihood_field import ScanPair
from refseq.view import Scan, View

UNITS: Mapping[str, float] = MappingProxyType(
    {"feet": 3.28, "inches": 39.4, "centimetres": 100.0, "millimetres": 1000.0}
)
"""Units that are asked for, and how many of them are a metre."""

APART, FARTHEST = 0.6, 2.0
"""Way of the odometer between two scans that are compared [m]: of less, rooms do not show how long it was, and over
more they look different."""

LARGEST_TURN = 0.2
"""No more may the robot have turned between both [rad]: it is taken to have gone straight on."""

PAIRS, FEWEST = 16, 5
"""Pairs of scans that are compared, spread over the drive, and of how many the way must be told."""

MEDIAN = 3.0
"""Scans are brought to this median [m], that of a room: for such are walls compared."""

WAYS = np.arange(0.0, 3.01, 0.1)
"""Ways that are tried, in scans of that size [m]."""

SHARP, STANDING = 0.02, 0.03
"""Ways that leave so little more unexplained than the best one are as good, and standing still must leave so much more
[m]."""

SPREAD = 2.0
"""A way is told where the longest of those that are as good is no longer than so many times the shortest."""

FALSE, AGREEING = 2.5, 0.8
"""No odometer is so many times too short; pairs of which this share tells so are of another unit."""

LIKE = 1.25
"""A ratio is that of a unit within this factor."""

Scans = Callable[[Sequence[int]], Sequence[Scan | None]]
"""Gives the scans of views by their numbers."""


class _Pair(NamedTuple):
    """Two views by their numbers, and the odometer's ``distance`` [m] and ``turn`` [rad] between them."""

    before: int
    after: int
    distance: float
    turn: float


def range_unit_doubt(views: Sequence[View], scans: Scans) -> str:
    """A sentence for ranges in another unit than the odometer's way between ``views``; empty for others."""
    pairs = _pairs(views)
    wanted = sorted({number for pair in pairs for number in (pair.before, pair.after)})
    seen = dict(zip(wanted, scans(wanted), strict=True))
    told = [_ratio(seen[pair.before], seen[pair.after], pair) for pair in pairs]
    ratios = [ratio for ratio in told if ratio is not None]
    if len(ratios) < FEWEST or np.mean([ratio > FALSE for ratio in ratios]) < AGREEING:
        return ""
    usual = float(np.median(ratios))
    unit = next((name for name, of_metre in UNITS.items() if abs(math.log(usual / of_metre)) < math.log(LIKE)), "")
    asked = f"are its ranges in {unit}" if unit else "are its ranges in metres"
    return f"its scans show a way {usual:.{0 if usual >= 10 else 1}f} times as long as the odometry's: {asked}?"


def _pairs(views: Sequence[View]) -> list[_Pair]:
    """Pairs of views that the robot went straight on between, spread over the drive."""
    ways, turns = (np.cumsum([getattr(view, name) for view in views]) for name in ("distance", "turn"))
    begins = np.linspace(0, len(views) - 1, 4 * PAIRS).astype(int).tolist() if views else ()
    found = dict.fromkeys(pair for number in begins if (pair := _from(number, ways, turns)) is not None)
    chosen, count = list(found), len(found)
    return [chosen[k] for k in np.unique(np.linspace(0, count - 1, PAIRS).astype(int)).tolist()] if count else []


def _from(number: int, ways: NDArray[np.float64], turns: NDArray[np.float64]) -> _Pair | None:
    """The pair of a view and the next one that is far enough; None where that is too far, or behind a turn."""
    beyond = np.flatnonzero(np.abs(ways[number:] - ways[number]) >= APART)
    if not len(beyond):
        return None
    after = number + int(beyond[0])
    distance, turn = float(ways[after] - ways[number]), float(turns[after] - turns[number])
    return _Pair(number, after, distance, turn) if abs(distance) < FARTHEST and abs(turn) < LARGEST_TURN else None


def _ratio(before: Scan | None, after: Scan | None, pair: _Pair) -> float | None:
    """Way that two scans show, in the unit of their ranges, over the odometer's [m]; None where they tell none."""
    there = _seen(before)
    if before is None or after is None or not len(there):
        return None
    size = MEDIAN / float(np.median(there))
    ways = math.copysign(1.0, pair.distance) * WAYS
    laid = ScanPair.of(_sized(before, size), _sized(after, size))
    if laid is None:
        return None
    left = laid.unexplained([(way, pair.turn) for way in ways.tolist()])
    if left[0] < left.min() + STANDING:
        return None
    good = WAYS[left < left.min() + SHARP]
    if good[0] == 0 or good[-1] == WAYS[-1] or good[-1] > SPREAD * good[0]:
        return None
    return float(WAYS[left.argmin()]) / size / abs(pair.distance)


def _seen(scan: Scan | None) -> NDArray[np.float32]:
    """Ranges that came back, also from beyond what the laser is said to see: that may be in metres, and they not."""
    return np.zeros(0, np.float32) if scan is None else scan.ranges[np.isfinite(scan.ranges) & (scan.ranges > 0)]


def _sized(scan: Scan, size: float) -> Scan:
    """The scan with all lengths times ``size``, and everything seen that came back."""
    farthest = 2 * float(_seen(scan).max(initial=1.0))
    return Scan(scan.ranges * np.float32(size), scan.start, scan.step, farthest * size)
