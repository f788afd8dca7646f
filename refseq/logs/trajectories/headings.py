"""Headings against the way driven: its direction where a file tells none, and headings that are degrees."""

import numpy as np
from numpy.typing import NDArray

LEAST_WAY = 0.5
"""Way over which a direction is told [m]: over less, a receiver's jitter turns a standing robot about."""
PIECE = 0.01
"""The same as a share of the room that is driven in, where that is more: positions may be millimetres."""
ALONG, LESS = 0.8, 0.2
"""Headings are degrees that go along the way so well (1: throughout), and by so much less as radians. Odometry and the
true poses of raw logs go along it by 0.89 to 1, and read in the other unit by 0.2 at most; a smaller ``LESS`` would
tell degrees of a robot that looks aside on a straight way."""


def headings_along(points: NDArray[np.float64], least: float = LEAST_WAY) -> NDArray[np.float64]:
    """Direction of travel at each of some points (n, 2) [m], (n,) [rad]; where the robot stands, as before.

    A direction is told over at least so much way. Nan where the robot never goes so far.
    """
    headings = np.full(len(points), np.nan)
    begin = 0
    for number in range(1, len(points)):
        step = points[number] - points[begin]
        if np.hypot(*step) >= least:
            headings[begin:number] = np.arctan2(step[1], step[0])
            begin = number
    known = np.flatnonzero(np.isfinite(headings))
    if len(known):
        headings[known[-1] :] = headings[known[-1]]
    return headings


def are_degrees(points: NDArray[np.float64], headings: NDArray[np.float64]) -> bool:
    """Tell whether headings (n,) go along the way through points (n, 2) as degrees, and not as radians.

    A sensor may look aside, and the robot drive back: only how steady the angle between both is counts. Headings within
    one turn [rad] are no degrees: on a straight way any would go along it.
    """
    if np.ptp(headings) <= 2 * np.pi:
        return False
    ways = headings_along(points, max(LEAST_WAY, PIECE * float(np.hypot(*np.ptp(points, axis=0)))))
    steps = np.hypot(*np.diff(points, axis=0).T)  # (n - 1,)
    if not np.isfinite(ways).all() or not steps.sum():
        return False
    degrees, radians = (_steadiness(turned - ways, steps) for turned in (np.radians(headings), headings))
    return degrees > ALONG and radians < degrees - LESS


def _steadiness(asides: NDArray[np.float64], steps: NDArray[np.float64]) -> float:
    """Length of the mean of doubled angles (n,) [rad], weighted by the ``steps`` (n - 1,) behind them; 1: one axis."""
    return float(abs((np.exp(2j * asides[:-1]) * steps).sum()) / steps.sum())
