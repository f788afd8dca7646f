"""View: all that the robot senses at one place, as a simulator, an MCAP file and a CARMEN log deliver it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.same_values import SameValues

ASSUMED = "assumed"
"""First word of a drive's note ``odometry`` in its metadata where nobody measured the way."""

FASTEST = 30.0
"""No robot of this kind goes faster [m/s]: where one seems to, its poses are not in metres, or jump."""

LASER = "laser"
"""Name of the laser among a view's sensors; the other names are those of its cameras."""


@dataclass(frozen=True, slots=True, eq=False)
class Scan(SameValues):
    """One turn of a laser scanner.

    ``ranges`` is (n,) float32 [m], counter-clockwise, ``inf`` where nothing came back; beam ``i`` points to
    ``start + i * step`` [rad] from the robot's forward direction. ``max_range`` [m] is the farthest that can be seen.
    """

    ranges: NDArray[np.float32]
    start: float = -np.pi / 2
    step: float = np.pi / 360
    max_range: float = 80.0

    @property
    def bearings(self) -> NDArray[np.float64]:
        """Directions of the beams, (n,) [rad]."""
        return self.start + self.step * np.arange(len(self.ranges), dtype=np.float64)

    @property
    def returned(self) -> NDArray[np.bool_]:
        """Mask of the beams that came back, (n,): from farther than 0 and nearer than ``max_range``."""
        mask: NDArray[np.bool_] = (self.ranges > 0) & (self.ranges < self.max_range)
        return mask

    @property
    def points(self) -> NDArray[np.float64]:
        """End points of all beams in the scanner's frame, (n, 2) [m]; a beam without return ends at ``max_range``."""
        reach = np.minimum(self.ranges, self.max_range).astype(np.float64)
        points: NDArray[np.float64] = reach[:, None] * np.stack([np.cos(self.bearings), np.sin(self.bearings)], axis=1)
        return points


def facing(scan: Scan) -> Scan:
    """The scan counter-clockwise with its middle ahead, within half a turn: all that looks for walls takes it for that.

    A scanner that sees all around may begin anywhere; its scan then begins behind the robot. Beams stay in their order,
    but for those of a scanner that turns clockwise, which are turned round. Where the last one looks where the first
    does, so does the new last one: one direction's second range is left out. A step of 0, of one beam, becomes 1.
    """
    count = len(scan.ranges)
    if scan.step < 0:
        last = scan.start + scan.step * (count - 1)
        scan = replace(scan, ranges=scan.ranges[::-1].copy(), start=last, step=-scan.step)
    elif scan.step == 0:  # of one beam alone, which has no next
        scan = replace(scan, step=1.0)
    once = round(2 * math.pi / scan.step)
    begin = -math.pi
    if count not in (once, once + 1):
        middle = scan.start + scan.step * (count - 1) / 2
        begin = scan.start - 2 * math.pi * round(middle / (2 * math.pi))
        return scan if begin == scan.start else replace(scan, start=begin)
    if abs(scan.start - begin) < scan.step:
        return scan
    bearings = (scan.bearings[:once] - begin) % (2 * math.pi)
    first = int(np.argmin(bearings))
    ranges = np.roll(scan.ranges[:once], -first)
    return replace(scan, ranges=np.append(ranges, ranges[: count - once]), start=begin + float(bearings[first]))


@dataclass(frozen=True, slots=True, eq=False)
class View(SameValues):
    """All sensors at one place (card V1); a missing sensor is not an error, it contributes nothing.

    ``time`` [s]; ``images`` maps a camera's name to (height, width) uint8; ``distance`` [m] (negative when the robot
    reversed) and ``turn`` [rad] are odometry since the last view; ``truth`` is the true pose where one is known: it is
    for scoring and drawing, a localiser must not look at it. ``has_odometry`` is False where nobody measured the
    motion: ``distance`` and ``turn`` are 0 then and mean nothing. ``behaviour`` is what the robot was told to do from
    here on, in its own words; empty: to go on as before, or nobody told.
    """

    time: float
    images: Mapping[str, NDArray[np.uint8]] = field(default_factory=lambda: MappingProxyType({}))
    scan: Scan | None = None
    distance: float = 0.0
    turn: float = 0.0
    truth: Pose | None = None
    behaviour: str = ""
    has_odometry: bool = True

    @property
    def sensors(self) -> frozenset[str]:
        """Names of the sensors that have something to say in this view."""
        return frozenset(self.images) | ({LASER} if self.scan is not None else set())


def measures(view: View) -> bool:
    """True where the odometer tells a motion in finite numbers."""
    return view.has_odometry and math.isfinite(view.distance) and math.isfinite(view.turn)
