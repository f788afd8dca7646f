"""Clock of the true poses against that of the drive's odometry, by the corners and the speed that both show.

Over pieces of the way, odometry and truth tell how far apart the ends are as the crow flies: less where a corner lies
between them. That needs no headings and no common frame. The clock is late by the time for which both agree best; its
standard error is the jackknife's over stretches of the drive (Künsch, "The jackknife and the bootstrap for general
stationary observations", Annals of Statistics 17, 1989).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import dead_reckoned
from refseq.logs.trajectory import Trajectory
from refseq.pose_graph import ways_along
from refseq.view import View

PIECE, EVERY = 5.0, 0.5
"""Pieces are so long by odometry, and one begins whenever so much of the way has gone by [m]."""
FEWEST = 20
"""Pieces below which nothing is told."""
STEP, FARTHEST = 0.1, 10.0
"""Delays are tried in steps of so much, up to so much either way [s], and to a quarter of the drive at most."""
STRETCHES = 10
"""Stretches of the drive, each left out once, for the standard error."""
SURE = 4.0
"""Standard errors by which a delay has to differ from none, as those of sensors."""
MOVED = 0.25
"""A clock is told of that puts true poses so far along the way [m]: half of the nearer tolerance of a score. The truth
of the raw MIT CSAIL log is 0.2 s late, which is 0.18 m."""


@dataclass(frozen=True, slots=True)
class TruthClock:
    """Delay of the true poses' stamps: ``late`` [s] against those of the odometry, with the standard ``error`` [s]."""

    late: float
    error: float


def truth_clock(views: Sequence[View]) -> TruthClock | None:
    """The delay of the true poses of views; None where nothing tells one, or none that matters."""
    times, way = np.array([view.time for view in views]), dead_reckoned(views)
    found = _clock_of(_truth_of(views), times, way) if len(way) else None
    if found is None or abs(found.late) < SURE * found.error:
        return None
    speed = ways_along(way)[-1] / (times[-1] - times[0])
    return found if abs(found.late) * speed > MOVED else None


def true_poses(views: Sequence[View], late: float = 0.0) -> NDArray[np.float64]:
    """True poses (n, 3) of views, set back by what they are ``late`` [s]; nan where they are not known."""
    if late:
        return _truth_of(views).at([view.time + late for view in views])
    unknown = (math.nan, math.nan, math.nan)
    return np.array([(pose.x, pose.y, pose.heading) if (pose := view.truth) else unknown for view in views])


def _truth_of(views: Sequence[View]) -> Trajectory:
    known = [(view.time, view.truth) for view in views if view.truth is not None]
    return Trajectory.of([time for time, _ in known], [pose for _, pose in known])


def _clock_of(truth: Trajectory, times: NDArray[np.float64], way: NDArray[np.float64]) -> TruthClock | None:
    """The delay at which truth agrees best with a way by odometry, (n, 3) at (n,) [s]; None where that tells none."""
    farthest = min(FARTHEST, (times[-1] - times[0]) / 4)
    lags = STEP * np.arange(-math.floor(farthest / STEP), math.floor(farthest / STEP) + 1)
    begins, ends = _pieces(way)
    begin, end = times[begins], times[ends]
    true = np.array([np.hypot(*(truth.at(end + lag) - truth.at(begin + lag))[:, :2].T) for lag in lags])
    told = np.hypot(*(way[ends] - way[begins])[:, :2].T)
    known = np.isfinite(true).all(axis=0)
    if len(lags) < 3 or known.sum() < FEWEST:
        return None
    squares = _squares(told[known], true[:, known])
    lowest = int(_misfit(squares.sum(axis=-1)).argmin())
    if lowest in (0, len(lags) - 1):
        return None
    whole = squares.sum(axis=-1)
    late = _lowest(_misfit(whole), lags)
    without = [_lowest(_misfit(whole - squares[..., stretch]), lags) for stretch in range(STRETCHES)]
    return TruthClock(late, math.sqrt((STRETCHES - 1) * float(np.var(without))))


def _pieces(way: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of the poses at which pieces of a way begin and end."""
    along = ways_along(way)
    begins = np.unique(np.searchsorted(along, np.arange(0.0, along[-1], EVERY)))
    ends = np.searchsorted(along, along[begins] + PIECE)
    whole = ends < len(along)
    return begins[whole], ends[whole]


def _squares(told: NDArray[np.float64], true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums of squares and products of lengths told (n,) and true (lags, n), by stretch: (3, lags, stretches)."""
    stretch = np.arange(len(told)) * STRETCHES // len(told)
    member = (stretch == np.arange(STRETCHES)[:, np.newaxis]).astype(np.float64)
    return np.stack([np.broadcast_to(told**2, true.shape) @ member.T, (told * true) @ member.T, true**2 @ member.T])


def _misfit(squares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squares left of the lengths told when true ones are stretched to fit them best, by lag."""
    told, both, true = squares
    misfit: NDArray[np.float64] = told - both**2 / np.maximum(true, 1e-9)
    return misfit


def _lowest(misfit: NDArray[np.float64], lags: NDArray[np.float64]) -> float:
    """The lag of the least misfit, between steps by a parabola."""
    at = int(misfit[1:-1].argmin()) + 1
    before, lowest, after = misfit[at - 1 : at + 2]
    bend = before - 2 * lowest + after
    return float(lags[at] + (STEP * (before - after) / (2 * bend) if bend > 0 else 0.0))
