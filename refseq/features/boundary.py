"""Bits of the scan's boundary: free area, longest and shortest dimension (B.3, Table B.3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.features.scan_bits import ScanBits
from refseq.view import Scan

AREAS = (2.0, 4.0, 8.0)
"""Thresholds of the free area [m²]."""
LENGTHS = (4.0, 8.0, 16.0)
"""Thresholds of the longest dimension [m]."""
RATIOS = (1.0, 4.0, 8.0)
"""Thresholds of longest over shortest; the first is met where anything came back, and is kept as the table has it."""


@dataclass(frozen=True, slots=True)
class Boundary:
    """Measures of a scan's free space: ``area`` [m²], ``longest`` and ``shortest`` dimension [m]."""

    area: float
    longest: float
    shortest: float

    @property
    def ratio(self) -> float:
        """Longest over shortest dimension, at least 1; 0 where nothing came back."""
        return self.longest / max(self.shortest, 1e-6)


def outline(scan: Scan) -> NDArray[np.float64]:
    """The polygon of the free space, (n, 2) [m]: the scanner and the end points of the beams that came back.

    Beams without return are left out: indoors they mean glass, black or slanting surfaces, and counting them at the
    maximum range would drown the room.
    """
    return np.concatenate([np.zeros((1, 2)), scan.points[scan.returned]])


def boundary_of(scan: Scan) -> Boundary:
    """Measure the outline; the dimensions are the extents along the principal axes of its points."""
    points = outline(scan)
    x, y = points.T
    # The shoelace formula; its closing term vanishes, for the first corner is the scanner itself, the origin.
    area = 0.5 * abs(float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1])))
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    extents = np.ptp(points @ axes, axis=0)
    return Boundary(area, float(extents.max()), float(extents.min()))


class ScanBoundary(ScanBits):
    """Table B.3's nine bits."""

    key = "boundary/laser"

    @property
    def size(self) -> int:
        """Always nine."""
        return len(AREAS) + len(LENGTHS) + len(RATIOS)

    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that are set."""
        return np.flatnonzero([value >= limit for value, limits in _rows(boundary_of(scan)) for limit in limits])


def _rows(found: Boundary) -> tuple[tuple[float, tuple[float, ...]], ...]:
    return ((found.area, AREAS), (found.longest, LENGTHS), (found.ratio, RATIOS))
