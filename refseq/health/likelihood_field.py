"""Points of a scan against the walls of the one before, for each motion between them that is supposed.

The last scan is drawn as walls on a grid that tells each cell's distance to the nearest of them. A motion says where
the robot is now; the mean distance of the new scan's points to the walls, each cut off at ``FARTHEST``, is what it
leaves unexplained. In a bare corridor that does not tell how far the robot has come, all leave the same, and none is
favoured: the aperture problem needs no case of its own. It is the likelihood field of beam models (S. Thrun, W. Burgard
and D. Fox, "Probabilistic Robotics", 2005, section 6.4).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan

CELL, REACH = 0.05, 10.0
"""Edge of a cell, and how far the grid reaches from the robot to all sides [m]."""

FARTHEST = 0.3
"""No point lies farther from the walls than this [m]: people and what comes into sight count alike for all."""

POINTS = 90
"""Points of a scan that are looked at: more tell little more, as neighbours agree."""

FEWEST = 30
"""Fewer points tell nothing."""

NEAR = 9.0
"""Points of the new scan farther than this are left out [m]: where beams meet a corridor's walls far apart, a wall is
drawn as single points, and what lies between them would seem unexplained. It is that of beams half a degree apart or
less; of wider ones less, as their spots on a wall are so far apart nearer by, by the root of their step."""
FINE = math.radians(0.5)
"""Step of the beams for which ``NEAR`` is meant [rad]."""

JOINED, FAILED = 0.8, 4
"""Neighbouring points nearer to each other than this are one wall [m]; where beams between them did not come back, as
many times farther, at most so many. A beam that came back from behind looked through an opening."""

SPARSE = 0.9
"""A scan shows walls no better than a laser whose beams are as far apart as this share of those that came back is, at
most, from the next: some come back from none of their neighbours' walls."""

ALONG, SIDEWAYS = (-1.0, 0.0, 1.0), (-0.1, 0.0, 0.1)
"""Errors that every hypothesis allows for: shares of its slack along the way, metres to the side."""

SLACK, DRIFT = 0.05, 0.05
"""Slack of a hypothesis [m], and its growth with each metre of the way."""

HEADING, HEADINGS = math.radians(1.5), 2
"""Headings are multiples of this, so that all hypotheses share them [rad]; each allows for so many to both sides."""


@dataclass(frozen=True, slots=True)
class ScanPair:
    """A scan's ``points`` (n, 2) [m] and the ``walls`` of the one before."""

    walls: "Walls"
    points: NDArray[np.float64]

    @classmethod
    def of(cls, before: Scan, after: Scan) -> Self | None:
        """The pair of two scans; None where there is too little to compare."""
        here, there = after.points[hits(after, _near(before))], hits(before, REACH)
        return cls(Walls(before, there), here) if min(len(here), len(there)) >= FEWEST else None

    @property
    def mirrored(self) -> Self:
        """The same of a laser that was turned upside down in between."""
        return replace(self, points=self.points * [1.0, -1.0])

    def unexplained(self, motions: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
        """Mean distance of the points to the walls after each motion (distance, turn) [m, rad], (motions,) [m]."""
        return self.walls.unexplained(self.points, motions)


def _near(scan: Scan) -> float:
    """Distance up to which a scan shows walls without gaps [m]."""
    apart = np.diff(np.flatnonzero(scan.returned))
    step = scan.step * float(np.quantile(apart, SPARSE)) if len(apart) else scan.step
    return NEAR * math.sqrt(FINE / max(FINE, step))


def hits(scan: Scan, reach: float) -> NDArray[np.intp]:
    """Numbers of the beams that came back from within a distance [m]."""
    return np.flatnonzero(scan.returned & (scan.ranges < reach))


class Walls:
    """Distances to the walls that the beams of these numbers show."""

    def __init__(self, scan: Scan, beams: NDArray[np.intp]) -> None:
        points = scan.points[beams]
        side = int(2 * REACH / CELL)
        grid = np.full((side, side), 255, np.uint8)
        cells = _cells(points)[:, ::-1].astype(np.int32)  # OpenCV has the column first
        # Beams between two points that came back from farther off.
        behind = np.diff(np.cumsum(scan.returned)[beams]) - 1
        joined = JOINED * np.where(behind, 1, np.minimum(np.diff(beams), FAILED))
        breaks = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > joined) + 1
        cv2.polylines(grid, [one.reshape(-1, 1, 2) for one in np.split(cells, breaks)], False, 0)
        self._away = cv2.distanceTransform(grid, cv2.DIST_L2, 3)  # in cells, float32
        self.half_view = min(math.pi, (len(scan.ranges) - 1) * scan.step / 2)
        self._middle = scan.start + (len(scan.ranges) - 1) * scan.step / 2

    def unexplained(self, points: NDArray[np.float64], motions: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
        """Mean distance to the walls of points (n, 2), seen after each motion (distance, turn), (motions,) [m].

        It is the least that a motion's errors allow for. Points that the last scan could not see count for nothing.
        """
        if len(points) > POINTS:
            points = points[np.linspace(0, len(points) - 1, POINTS).astype(np.intp)]
        x, y, heading = _candidates(motions)[:, :, None]
        cos, sin = np.cos(heading), np.sin(heading)
        # (candidates, n), axis by axis: sums over pairs of numbers take twice as long.
        x = x + cos * points[:, 0] - sin * points[:, 1]
        y = y + sin * points[:, 0] + cos * points[:, 1]
        row, column, side = _cells(x), _cells(y), len(self._away)
        seen = (row >= 0) & (row < side) & (column >= 0) & (column < side)
        if self.half_view < math.pi - 1e-6:
            # A bearing is within the field of view where its cosine to the middle is large enough.
            ahead = x * math.cos(self._middle) + y * math.sin(self._middle)
            seen &= ahead >= math.cos(self.half_view) * np.sqrt(x**2 + y**2)
        found = self._away.take(row * side + column, mode="clip")
        # What lies in the next cell may be there by rounding alone.
        distances = np.clip((found - 1) * CELL, 0.0, FARTHEST)
        counts = seen.sum(axis=1)
        means = np.where(counts >= FEWEST, (distances * seen).sum(axis=1) / np.maximum(counts, 1), FARTHEST)
        return np.asarray(means.reshape(len(motions), -1).min(axis=1))


def _candidates(motions: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Poses after motions (distance, turn) with the errors that are allowed for, motion by motion, (3, n).

    They are x and y [m] and heading [rad].
    """
    distance, turn = np.array(motions).T[..., None, None, None]
    heading = HEADING * (np.round(turn / HEADING) + np.arange(-HEADINGS, HEADINGS + 1)[:, None, None])
    along = distance + np.array(ALONG)[:, None] * (SLACK + DRIFT * np.abs(distance))
    cos, sin, side = np.cos(heading / 2), np.sin(heading / 2), np.array(SIDEWAYS)
    poses = np.broadcast_arrays(along * cos - side * sin, along * sin + side * cos, heading)
    return np.stack(poses).reshape(3, -1)


def _cells(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Cells of points (…, 2) [m]."""
    return np.asarray(np.floor((points + REACH) / CELL), np.intp)
