"""The laser's watch: how far the robot can go before what lies in its way, from a scan and the pitch at its time."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.motion import Twist
from refseq_bench.robots.mounting import FLOOR, Mounting
from refseq_bench.robots.robot import Shape
from refseq_bench.robots.signals import LaserScan

ASIDE = 0.05
"""The robot is taken for so much wider on either side [m]: a choice that leaves 9 cm either side in a 0.9 m door."""
BLIND_TIME = 0.3
"""A laser that has told of no range for so long [s], longer than a scan takes, is lost: a choice."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """An obstacle: how far the robot's front can still go [m], and in which bearing it was seen [rad]."""

    gap: float
    bearing: float


class ObstacleMonitor:
    """The newest scan, with the pitch at its time, and since when it has told of no range.

    Scans come more seldom than ticks: what was found in one is kept until the next.
    """

    def __init__(self, shape: Shape, mounting: Mounting) -> None:
        self._shape, self._mounting = shape, mounting
        self._scan: LaserScan | None = None
        self._pitch = 0.0
        self._met: dict[Twist, Obstacle | None] = {}
        self._blind = False
        self._blind_since: float | None = None

    def take(self, scan: LaserScan | None, pitch: float, time: float) -> None:
        """Look at the scan there is at ``time`` [s]; where it is a new one, it was taken at ``pitch`` [rad]."""
        if scan is not self._scan:
            self._scan, self._pitch, self._met = scan, pitch, {}
            self._blind = scan is not None and bool(np.isnan(scan.ranges).any())
        if not self._blind:
            self._blind_since = None
        elif self._blind_since is None:
            self._blind_since = time

    def lost(self, time: float) -> str | None:
        """Tell which beam has read no number for too long, None while the laser is well."""
        if self._scan is None or self._blind_since is None or time - self._blind_since <= BLIND_TIME:
            return None
        return f"laser beam {int(np.argmax(np.isnan(self._scan.ranges)))} reads no number"

    def nearest(self, arcs: Iterable[Twist]) -> Obstacle | None:
        """Find what the robot meets first on any of some arcs."""
        met = (self._meets(arc) for arc in arcs)
        return min((found for found in met if found), key=lambda found: found.gap, default=None)

    def _meets(self, arc: Twist) -> Obstacle | None:
        if self._scan is None:
            return None
        if arc not in self._met:
            self._met[arc] = obstacle(self._scan, self._pitch, arc, self._shape, self._mounting)
        return self._met[arc]


def obstacle(scan: LaserScan, pitch: float, twist: Twist, shape: Shape, mounting: Mounting) -> Obstacle | None:
    """Find what the robot meets first on the arc of ``twist``, None where the way is free.

    ``pitch`` [rad], nose down, is that of the moment of the scan. Beams that end on the floor are left out.
    """
    seen = np.isfinite(scan.ranges)
    bearings = scan.bearings[seen]
    ends = mounting.ends(scan.ranges[seen].astype(float), bearings, pitch)
    way, aside = _along_arc(ends[:, :2], twist)
    meets = (ends[:, 2] > FLOOR) & (np.abs(aside) < shape.half_width + ASIDE) & (way > 0)
    if not meets.any():
        return None
    first = int(np.argmin(np.where(meets, way, math.inf)))
    return Obstacle(float(way[first]) - shape.ahead, float(bearings[first]))


def _along_arc(points: NDArray[np.float64], twist: Twist) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances of points (n, 2) along the arc of ``twist``, and beside it [m]."""
    x, y = points.T
    if abs(twist.angular) < 1e-3 * max(abs(twist.linear), 0.1):
        return x, y
    radius = max(twist.linear, 0.1) / twist.angular  # at a crawl the arc is that of 0.1 m/s, not a turn on the spot
    side = math.copysign(1.0, radius)
    turned = np.arctan2(x, side * (radius - y))
    return abs(radius) * turned, side * (radius - np.hypot(x, radius - y) * side)
