"""Turns as sensors see them: a scan and a row of pixels shift sideways, without any calibration."""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from refseq.view import Scan

REACH = 10.0
"""Ranges are clipped here before scans are compared [m]: beams without a return are as far as a far wall."""

WIDEST_SHIFT = 0.25
"""Largest shift that is looked for, as a share of a scan's or picture's width."""


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
    shifts = np.arange(-widest, widest + 1)
    moved = np.abs(sliding_window_view(np.pad(after, widest), n) - before)  # (shifts, n)
    costs = (moved * _overlap(n, widest)).sum(axis=1) / (n - np.abs(shifts))
    return float(vertices(-costs[np.newaxis])[0]) - widest


@lru_cache(maxsize=8)
def _overlap(n: int, widest: int) -> NDArray[np.bool_]:
    """Elements of ``n`` that are there after shifts from −``widest`` to ``widest``, (shifts, n)."""
    moved = np.arange(n) + np.arange(-widest, widest + 1)[:, None]
    inside: NDArray[np.bool_] = (moved >= 0) & (moved < n)
    inside.setflags(write=False)
    return inside


def vertices(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Index of the highest value of each row (n, m), to a fraction by the parabola through it and its neighbours."""
    rows, top = np.arange(len(heights)), heights.argmax(axis=1)
    inner = top.clip(1, heights.shape[1] - 2)
    left, middle, right = (heights[rows, inner + step] for step in (-1, 0, 1))
    bend = left - 2 * middle + right
    aside = np.divide(0.5 * (left - right), bend, out=np.zeros(len(bend)), where=(bend != 0) & (top == inner))
    found: NDArray[np.float64] = top + aside
    return found
