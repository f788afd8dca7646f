"""Motion between two scans against the odometer's: how well each hypothesis of a fault predicts the next scan.

The last scan is drawn as walls on a grid that tells each cell's distance to the nearest of them. A hypothesis says
where the robot is now; the mean distance of the new scan's points to the walls, each cut off at ``FARTHEST``, is what
it leaves unexplained. In a bare corridor that does not tell how far the robot has come, all leave the same, and none is
favoured: the aperture problem needs no case of its own. It is the likelihood field of beam models (S. Thrun, W. Burgard
and D. Fox, "Probabilistic Robotics", 2005, section 6.4).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.fault import FaultKind
from refseq.health.change import MOST, bounded
from refseq.view import Scan, View, measures

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

APART = 0.4
"""Way between two scans that are compared [m]: errors of single short steps are as large as the steps."""

FARTHEST_STEP = 3.0
"""Scans taken farther apart than this have too little in common [m]."""

LARGEST_TURN = 0.6
"""Of larger turns between two scans nobody knows on which way the robot made them [rad]: they tell of no fault."""

CLEAR_TURN = 0.03
"""A smaller turn has no sign that could be told from its own error [rad]."""

INDEPENDENT, ROUGHNESS = 6.0, 0.01
"""A scan counts as so many independent points, whose distances to the walls have this mean at least [m]."""

ALONG, SIDEWAYS = (-1.0, 0.0, 1.0), (-0.1, 0.0, 0.1)
"""Errors that every hypothesis allows for: shares of its slack along the way, metres to the side."""

HEADING, HEADINGS = math.radians(1.5), 2
"""Headings are multiples of this, so that all hypotheses share them [rad]; each allows for so many to both sides."""

STILL = 0.02
"""An odometer that has gone less than this, and turned less in radians, says that the robot stands [m]."""

STEPS = (0.25, 0.5, 0.75, 1.0)
"""Ways that a robot may have come whose odometer stands [m]."""


ELSEWHERE = 0.03
"""Mean distance of points to the walls of a scan taken somewhere else [m]: 0.05 as the median in annex and in offices,
where a robot that stands has 0.003 at most."""

FOLLOWS = 4.0
"""Two scans say no more of whether the robot was carried between them [nats]."""


@dataclass(frozen=True, slots=True)
class MotionRatios:
    """Log-likelihood ratios [nats] of faults of the odometer, and of a laser that is upside down or became so.

    ``mirrored``: at both scans; ``flipped``: at one of the two. ``carried``: of a robot that was carried between the
    two, or whose wheel span, against one that came as its odometer tells; it is 0 in a bare corridor, which looks alike
    everywhere.
    """

    odometry: Mapping[FaultKind, float]
    mirrored: float = 0.0
    flipped: float = 0.0
    carried: float = 0.0


SILENT = MotionRatios({})
"""Nothing to tell."""


class MotionWatch:
    """Scans in their order; two are compared when the robot has gone ``APART`` [m], or turned clearly."""

    def __init__(self) -> None:
        self._last: Scan | None = None
        self._begun: Scan | None = None
        self._distance = self._turn = 0.0
        self._unseen = False

    def update(self, scan: Scan | None, view: View) -> MotionRatios:
        """Take the next view and its scan, None where there is no new one: its way is then part of the next one's.

        A scan that came a short way adds to the next as well.
        """
        if not measures(view):
            self._last = scan
            if scan is not None:
                self._begin(scan)
            return SILENT
        last, unseen = self._last, self._unseen
        self._last, self._unseen = scan or last, scan is None
        if last is None:
            if scan is not None:
                self._begin(scan)
            return SILENT
        if scan is not None and not unseen and abs(view.distance) < STILL and abs(view.turn) < STILL:
            return motion_ratios(last, scan, 0.0, 0.0)
        begun = self._begun or last
        self._distance, self._turn = self._distance + view.distance, self._turn + view.turn
        if scan is None:
            return SILENT
        if abs(self._distance) < APART and abs(self._turn) < 8 * CLEAR_TURN:
            return SILENT
        distance, turn = self._distance, self._turn
        self._begin(scan)
        return motion_ratios(begun, scan, distance, turn)

    def _begin(self, scan: Scan) -> None:
        self._begun, self._distance, self._turn = scan, 0.0, 0.0


def motion_ratios(before: Scan, after: Scan, distance: float, turn: float) -> MotionRatios:
    """Ratios of the hypotheses, given the odometer's ``distance`` [m] and ``turn`` [rad] between two scans."""
    if abs(distance) > FARTHEST_STEP:
        return SILENT
    here, there = after.points[_hits(after, _near(before))], _hits(before, REACH)
    if min(len(here), len(there)) < FEWEST:
        return SILENT
    walls = _Walls(before, there)
    if abs(turn) > LARGEST_TURN:
        return MotionRatios({}, carried=_spun(walls, here, distance, turn))
    if abs(distance) < STILL and abs(turn) < STILL:
        stands, moves = walls.stands_or_moves(here)
        return MotionRatios({FaultKind.FROZEN: bounded(_ratio(moves, stands))})
    # All at once: one by one they make a comparison a fifth dearer.
    motions = [
        (distance, turn),
        (0.0, 0.0),
        (distance, -turn),
        (distance / 2, turn / 2),
        (distance / 2, turn),
        (-distance, -turn),
        (-distance, turn),
    ]
    healthy, slipping, turned, halved, half_way, back, back_way = walls.unexplained(here, motions).tolist()
    ratios = {
        FaultKind.DOUBLED: _ratio(min(halved, half_way), healthy),
        FaultKind.REVERSED: _ratio(min(back, back_way), healthy),
        FaultKind.SLIPPING: _ratio(slipping, healthy),
    }
    mirrored = _ratio(turned, healthy) if abs(turn) > CLEAR_TURN else 0.0
    flipped = _ratio(walls.unexplained(here * [1.0, -1.0], [(distance, turn)]).item(), healthy)
    # Bounded by one factor, so that the hypothesis that explains most stays ahead of the others.
    share = min(1.0, MOST / max(1e-9, mirrored, flipped, *ratios.values()))
    return MotionRatios(
        {kind: bounded(ratio * share) for kind, ratio in ratios.items()},
        bounded(mirrored * share),
        bounded(flipped * share),
        float(np.clip(_ratio(min(slipping, halved, half_way, back, back_way, ELSEWHERE), healthy), -FOLLOWS, FOLLOWS)),
    )


def moved_ratio(before: Scan, after: Scan) -> float | None:
    """Log-likelihood ratio of a robot that has moved, or was carried off, between two scans against one that stood.

    None where there is too little to compare.
    """
    here, there = after.points[_hits(after, _near(before))], _hits(before, REACH)
    if min(len(here), len(there)) < FEWEST:
        return None
    stands, moves = _Walls(before, there).stands_or_moves(here)
    return bounded(_ratio(min(moves, ELSEWHERE), stands))


def unexplained_ways(before: Scan, after: Scan, ways: NDArray[np.float64], turn: float) -> NDArray[np.float64] | None:
    """Mean distance of a scan's points to the walls of the one before for each of ``ways`` straight on, (ways,) [m].

    ``turn`` [rad] is the odometer's. None where there is too little to compare.
    """
    here, there = after.points[_hits(after, _near(before))], _hits(before, REACH)
    if min(len(here), len(there)) < FEWEST:
        return None
    return _Walls(before, there).unexplained(here, [(float(way), turn) for way in ways])


def _spun(walls: "_Walls", here: NDArray[np.float64], distance: float, turn: float) -> float:
    """Log-likelihood ratio of a robot that went straight on or stood, a wheel spinning, against a turn, 0 or more.

    After a turn of half its field of view a laser sees too little of what it saw: then nobody can tell.
    """
    if abs(turn) > walls.half_view:
        return 0.0
    ways = [(distance, turn), (0.0, turn), (distance, 0.0), (0.0, 0.0)]
    arc, on_the_spot, straight, stood = walls.unexplained(here, ways).tolist()
    return float(np.clip(_ratio(min(straight, stood), min(arc, on_the_spot)), 0.0, FOLLOWS))


def _ratio(fault: float, health: float) -> float:
    """Log-likelihood ratio of what two hypotheses leave unexplained [m]: distances are exponentially distributed."""
    return INDEPENDENT * (health - fault) / max(ROUGHNESS, min(health, fault))


def _near(scan: Scan) -> float:
    """Distance up to which a scan shows walls without gaps [m]."""
    apart = np.diff(np.flatnonzero(scan.returned))
    step = scan.step * float(np.quantile(apart, SPARSE)) if len(apart) else scan.step
    return NEAR * math.sqrt(FINE / max(FINE, step))


def _hits(scan: Scan, reach: float) -> NDArray[np.intp]:
    """Numbers of the beams that came back from within a distance [m]."""
    return np.flatnonzero(scan.returned & (scan.ranges < reach))


class _Walls:
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

    def stands_or_moves(self, points: NDArray[np.float64]) -> tuple[float, float]:
        """Unexplained [m] of a robot that stood, and the least of one that has gone some way straight on."""
        stands, *moves = self.unexplained(points, [(step, 0.0) for step in (0.0, *STEPS)]).tolist()
        return stands, min(moves)

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
    along = distance + np.array(ALONG)[:, None] * (0.05 + 0.05 * np.abs(distance))
    cos, sin, side = np.cos(heading / 2), np.sin(heading / 2), np.array(SIDEWAYS)
    poses = np.broadcast_arrays(along * cos - side * sin, along * sin + side * cos, heading)
    return np.stack(poses).reshape(3, -1)


def _cells(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Cells of points (…, 2) [m]."""
    return np.asarray(np.floor((points + REACH) / CELL), np.intp)
