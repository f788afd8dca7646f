"""Corners of a scan, where two wall-like lines meet, and their bits (5.2.2, Table 1.1).

The thesis names corners beside walls and doors as what the laser detects; it gives no table of bits for them, so theirs
are those of its doors (Table B.2), one table for either kind of corner.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.features.scan_bits import ScanBits
from refseq.features.walls import WallSettings, count_bits, find_lines
from refseq.view import Scan

LENGTH = 0.4
"""Lines that are so long make a corner [m]: a choice. Shorter ones are legs of chairs and edges of doors."""
GAP = 0.25
"""Their inner ends are no farther from where they cross [m]: a choice, a few beams at 4 m."""
SHARPEST, BLUNTEST = math.radians(50), math.radians(130)
"""The lines turn by an angle between these: choices about a right angle."""
COUNTS = (1, 2)


@dataclass(frozen=True, slots=True)
class ScanCorners:
    """Corners of a scan, m of them: where they are, (m, 2) [m] from the scanner.

    ``inside`` (m,) is true for those of a room, into which the robot looks, false for those that stand out towards it.
    """

    place: NDArray[np.float64]
    inside: NDArray[np.bool_]

    @property
    def distance(self) -> NDArray[np.float64]:
        """From the scanner, (m,) [m]."""
        return np.asarray(np.hypot(*self.place.T), np.float64)


def find_corners(scan: Scan, walls: WallSettings) -> ScanCorners:
    """Corners between lines that follow each other in the scan."""
    lines = find_lines(scan, walls)
    lines = lines[lines.length >= LENGTH]
    one, other = lines[np.arange(len(lines) - 1)], lines[np.arange(1, len(lines))]
    a, b = one.direction, other.direction
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    turn = np.arctan2(cross, (a * b).sum(axis=1))  # beams go round to the left, and so do a room's walls
    sharp = (np.abs(turn) > SHARPEST) & (np.abs(turn) < BLUNTEST)
    between = other.centre - one.centre
    along = (between[:, 0] * b[:, 1] - between[:, 1] * b[:, 0]) / np.where(sharp, cross, 1.0)
    place = one.centre + along[:, None] * a
    near = [np.hypot(*(place - end).T) <= GAP for end in (one.end, other.start)]
    found = sharp & near[0] & near[1]
    return ScanCorners(place[found], turn[found] > 0)


class CornerCounts(ScanBits):
    """Twelve bits: at least 1, 2 corners at 4 m and more, at 2 to 4 m, and nearer; first those inside, then outside."""

    key = "corners/laser"

    def __init__(self, walls: WallSettings) -> None:
        self.walls = walls

    @property
    def size(self) -> int:
        """Always twelve."""
        return 2 * 3 * len(COUNTS)

    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that are set."""
        corners = find_corners(scan, self.walls)
        distances = corners.distance
        inside, outside = (count_bits(distances[kind], COUNTS) for kind in (corners.inside, ~corners.inside))
        return np.concatenate([inside, outside + 3 * len(COUNTS)])
