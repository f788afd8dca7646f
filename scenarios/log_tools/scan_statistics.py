"""Statistics of a laser's scans by which a real one and a simulated one can be compared."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan
from refseq_bench.scenarios.errors import ScenarioError

PIECE = math.radians(20)
"""Angle of the pieces that are taken for walls [rad]: wider ones are rarely straight, narrower ones tell too little."""
SHORTEST, FARTHEST_OFF = 0.5, 0.08
"""A piece is a wall if it is so long, and none of its points so far from its line [m]."""
STEEPEST = 0.4
"""Sine of the least angle at which a beam may meet a wall: flat ones show the spot of the beam, not its noise."""
FARTHEST_WALL = 20.0
"""Walls beyond this are not looked at [m]."""
EDGE = 0.3
"""Neighbouring beams that differ by more than this see two things [m]."""
FULL = 0.99
"""Share of the greatest range from which on nothing is taken to have come back."""


@dataclass(frozen=True, slots=True)
class ScanStatistics:
    """Statistics of some ``scans`` of ``beams`` beams.

    ``residual_median`` and ``residual_p90`` are quantiles over ``walls`` of the standard deviation of ranges about a
    straight wall [m], nan without one. Shares: ``none`` of beams that bring nothing back, ``edges`` of neighbours that
    see two things. ``median_range`` is the mean over scans [m].
    """

    scans: int
    beams: int
    walls: int
    residual_median: float
    residual_p90: float
    none: float
    edges: float
    median_range: float


def scan_statistics(scans: Sequence[Scan], name: str) -> ScanStatistics:
    """Take the statistics of scans. Raises ``ScenarioError`` where there is none that sees anything."""
    seen = [(scan, back) for scan in scans if (back := _came_back(scan)).sum() > 1]
    if not seen:
        raise ScenarioError(f"{name}: has no scan that sees anything; valid is a log with a laser")
    ranges = [scan.ranges[back].astype(np.float64) for scan, back in seen]
    residuals = [residual for scan, back in seen for residual in _wall_residuals(scan, back)]
    median, p90 = np.quantile(residuals, (0.5, 0.9)) if residuals else (math.nan, math.nan)
    return ScanStatistics(
        scans=len(seen),
        beams=len(seen[0][0].ranges),
        walls=len(residuals),
        residual_median=float(median),
        residual_p90=float(p90),
        none=float(np.mean([1 - back.mean() for _, back in seen])),
        edges=float(np.mean([np.mean(np.abs(np.diff(one)) > EDGE) for one in ranges])),
        median_range=float(np.mean([np.median(one) for one in ranges])),
    )


def _came_back(scan: Scan) -> NDArray[np.bool_]:
    return np.isfinite(scan.ranges) & (scan.ranges < FULL * scan.max_range)


def _wall_residuals(scan: Scan, back: NDArray[np.bool_]) -> Iterator[float]:
    """Standard deviations of ranges about each straight piece of a scan [m]."""
    width = round(PIECE / scan.step)
    angles = scan.start + scan.step * np.arange(len(scan.ranges))
    near = back & (scan.ranges < FARTHEST_WALL)
    for first in range(0, len(angles) - width, width):
        piece = slice(first, first + width)
        if near[piece].all():
            beams = np.stack([np.cos(angles[piece]), np.sin(angles[piece])], axis=1)
            off = _off_line(beams, scan.ranges[piece].astype(np.float64))
            if off is not None:
                yield float(off.std(ddof=2))


def _off_line(beams: NDArray[np.float64], ranges: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Residuals of points behind the line through them, along their beams [m]; None where they are no wall."""
    points = beams * ranges[:, None]
    centred = points - points.mean(axis=0)
    along, normal = np.linalg.svd(centred, full_matrices=False)[2]
    sines = np.abs(beams @ normal)
    if np.ptp(centred @ along) < SHORTEST or sines.min() < STEEPEST:
        return None
    off: NDArray[np.float64] = (centred @ normal) / sines
    return off if np.abs(off).max() < FARTHEST_OFF else None
