"""Fixed offsets between sensors' clocks, from turns: the odometer's against those that scans and pictures show.

Turns are what every sensor sees of a motion without any calibration: a scan and a row of pixels shift sideways. The
offset is the lag at which both correlate best, as in Kelly and Sukhatme, "A general framework for temporal calibration
of multiple proprioceptive and exteroceptive sensors" (ISER 2010).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan

LAGS = np.arange(-1.0, 1.0 + 1e-9, 0.02)
"""Offsets that are tried [s]."""

LEAST_PAIRS = 30
"""Fewer pairs of scans or pictures tell nothing."""

LEAST_TURN = math.radians(60)
"""Sum of the odometer's turns below which no offset can be told [rad]."""

LEAST_CORRELATION = 0.5
"""Correlation below which two sensors are not said to see the same turns."""

REACH = 10.0
"""Ranges are clipped here before scans are compared [m]: beams without a return are as far as a far wall."""

WIDEST_SHIFT = 0.25
"""Largest shift that is looked for, as a share of a scan's or picture's width."""


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """A sensor's clock against the odometer's.

    ``lag`` [s]: its stamps are so much later than the odometer's for the same moment. ``correlation`` of the turns, in
    [−1, 1]: negative where one of the two is upside down or mirrored. ``gain``: turns that it shows over those of the
    odometer, NaN of a camera, whose pixels are no angles.
    """

    lag: float
    correlation: float
    gain: float = math.nan


def scan_turns(scans: Sequence[Scan]) -> NDArray[np.float64]:
    """The robot's turn from each scan to the next [rad], (n − 1,); left is positive."""
    profiles = [np.minimum(np.nan_to_num(scan.ranges, nan=REACH, posinf=REACH), REACH) for scan in scans]
    steps = [scan.step for scan in scans[:-1]]
    # A robot that turns to its left sees the walls go round to its right, to smaller bearings.
    return -np.array([_shift(a, b) for a, b in pairwise(profiles)]) * np.array(steps)


def picture_turns(profiles: Sequence[NDArray[np.floating]]) -> NDArray[np.float64]:
    """The shift from each picture's row of column means to the next [columns], (n − 1,); left turns are positive."""
    # A robot that turns to its left sees the scene go to the right, to larger columns.
    return np.array([_shift(a, b) for a, b in pairwise(profiles)])


def _shift(before: NDArray[np.floating], after: NDArray[np.floating]) -> float:
    """Elements by which ``after`` is ``before`` moved to higher indices, to a fraction; NaN for other lengths."""
    n = len(before)
    if len(after) != n or n < 8:
        return math.nan
    widest = max(1, int(n * WIDEST_SHIFT))
    costs = np.array(
        [
            np.abs(after[max(0, s) : n + min(0, s)] - before[max(0, -s) : n - max(0, s)]).mean()
            for s in range(-widest, widest + 1)
        ]
    )
    return float(_vertex(-costs)) - widest


def _vertex(heights: NDArray[np.float64]) -> float:
    """Index of the highest value, to a fraction by the parabola through it and its neighbours."""
    top = int(heights.argmax())
    if top in (0, len(heights) - 1):
        return float(top)
    left, middle, right = heights[top - 1 : top + 2]
    bend = left - 2 * middle + right
    return top + (0.5 * float((left - right) / bend) if bend else 0.0)


def clock_offset(
    stamps: NDArray[np.float64], turns: NDArray[np.float64], times: NDArray[np.float64], headings: NDArray[np.float64]
) -> ClockOffset | None:
    """The offset of a sensor with ``turns`` (n − 1,) between its ``stamps`` (n,) [s] to the odometer's (m,) poses.

    None where the robot hardly turned, or where both do not see the same turns.
    """
    order = np.argsort(times, kind="stable")
    times, headings = times[order], np.unwrap(headings[order])
    inside = (stamps[:-1] + LAGS[0] >= times[0]) & (stamps[1:] + LAGS[-1] <= times[-1]) if len(times) else None
    if inside is None:
        return None
    used = inside & np.isfinite(turns) & (np.diff(stamps) > 0)
    if used.sum() < LEAST_PAIRS:
        return None
    begin, end, seen = stamps[:-1][used], stamps[1:][used], turns[used]
    told = np.array([np.interp(end - lag, times, headings) - np.interp(begin - lag, times, headings) for lag in LAGS])
    middle = told[len(LAGS) // 2]
    if np.abs(middle).sum() < LEAST_TURN or not seen.std():
        return None
    return _best(told, seen)


def _best(told: NDArray[np.float64], seen: NDArray[np.float64]) -> ClockOffset | None:
    """The lag at which the odometer's turns (lags, n) correlate best with those seen (n,)."""
    spread = told.std(axis=1)
    centred = told - told.mean(axis=1, keepdims=True)
    correlations = np.where(
        spread > 0, centred @ (seen - seen.mean()) / (len(seen) * np.maximum(spread, 1e-12) * seen.std()), 0.0
    )
    strength = np.abs(correlations)
    top = int(strength.argmax())
    if strength[top] < LEAST_CORRELATION or top in (0, len(LAGS) - 1):
        return None
    lag = float(np.interp(_vertex(strength), np.arange(len(LAGS)), LAGS))
    gain = float(centred[top] @ seen / (centred[top] @ centred[top]))
    return ClockOffset(lag, float(correlations[top]), gain)
