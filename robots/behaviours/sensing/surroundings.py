"""Local map of the points of a robot's scans: in the odometer's frame, so that it stays put between two scans."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import RobotDescription, Senses
from refseq_bench.robots.mounting import FLOOR
from refseq_bench.robots.planar import PlanarPose, into, out_of
from refseq_bench.robots.signals import LaserScan
from refseq_bench.rows import distinct_rows

REACH = 6.0
"""Range of behaviours' sight [m]: a choice."""
KEPT_BEHIND = 1.5
"""Range within which it remembers what its laser has left behind [m]: a choice, more than any robot's tail."""
MOST_BLIND = 0.5
"""Share of beams that are no numbers from which on a scan is lost: a choice."""
STALE_SCAN = 1.0
"""With no new scan for so long the laser is lost [s]: a choice, five times the time that one takes."""
CELL = 0.05
"""Side of the squares of which one point each is remembered [m]: a choice."""


class Surroundings:
    """Points that the laser has met.

    The laser looks ahead only: what it has passed is remembered as long as the robot is near, so that its tail and its
    sides have eyes. ``lost`` tells why there is no picture now, and is empty while there is one.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self._robot = robot
        self._scan: LaserScan | None = None
        self._since = 0.0
        self._ahead = self._behind = np.empty((0, 2))
        self.lost = "no scan yet"
        self.fresh = False
        """True if the last look brought a new scan."""

    def look(self, senses: Senses) -> None:
        """Take in what is new."""
        scan, self.fresh = senses.scan, False
        if scan is None:
            self._scan, self.lost = None, "the scan is lost"
        elif scan is not self._scan:
            self._scan, self._since = scan, senses.now
            self._take(scan, senses)
        elif senses.now - self._since > STALE_SCAN:
            self.lost = f"no new scan for {senses.now - self._since:.1f} s"

    def _take(self, scan: LaserScan, senses: Senses) -> None:
        ranges = np.asarray(scan.ranges, np.float64)
        valid = np.count_nonzero(ranges >= 0)
        if valid <= MOST_BLIND * len(ranges):
            self.lost = f"{len(ranges) - valid} of {len(ranges)} laser beams read no range"
            return
        self.lost, self.fresh = "", True
        self._remember(senses.pose)
        self._ahead = self._met(ranges, np.asarray(scan.bearings, np.float64), senses.state.pitch, senses.pose)

    def points(self, pose: PlanarPose) -> NDArray[np.float64]:
        """All points, (n, 2) [m], in the frame of a robot at ``pose``: x forward, y to the left."""
        return into(pose, self.all)

    @property
    def all(self) -> NDArray[np.float64]:
        """All points, (n, 2) [m], in the odometer's frame."""
        return np.concatenate([self._ahead, self._behind])

    def _met(
        self, ranges: NDArray[np.float64], bearings: NDArray[np.float64], pitch: float, pose: PlanarPose
    ) -> NDArray[np.float64]:
        """End points of the beams that met something above the floor, in the odometer's frame."""
        near = (ranges >= 0) & (ranges < REACH)
        ends = self._robot.laser.ends(ranges[near], bearings[near], pitch if math.isfinite(pitch) else 0.0)
        return out_of(pose, ends[ends[:, 2] > FLOOR, :2])

    def _remember(self, pose: PlanarPose) -> None:
        """Keep of all earlier points those that the laser cannot see now and that are still near."""
        seen = into(pose, self.all)
        hidden = (seen[:, 0] < self._robot.laser.ahead) & (np.hypot(*seen.T) < KEPT_BEHIND)
        self._behind = thinned(self.all[hidden])


def thinned(points: NDArray[np.float64], cell: float = CELL) -> NDArray[np.float64]:
    """The mean of the points in each square of a grid: as many, then, near the robot as far away.

    Squares are in order of x, then of y. They stay floats: an ill odometer may be so far off that none has a number.
    """
    if not len(points):
        return points
    squares = np.floor(points / cell)
    _, square = distinct_rows(squares)
    count = np.bincount(square)
    return np.stack([np.bincount(square, points[:, k]) / count for k in (0, 1)], axis=1)
