"""Motion between two scans against the odometer's: how well each hypothesis of a fault predicts the next scan.

The less of the next scan the motion of a hypothesis leaves unexplained (``ScanPair``), the likelier it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from refseq.fault import FaultKind
from refseq.health.change import MOST, bounded
from refseq.health.likelihood_field import ScanPair
from refseq.view import Scan, View, measures

FARTHEST_STEP = 3.0
"""Scans taken farther apart than this have too little in common [m]."""

LARGEST_TURN = 0.6
"""Of larger turns between two scans nobody knows on which way the robot made them [rad]: they tell of no fault."""

CLEAR_TURN = 0.03
"""A smaller turn has no sign that could be told from its own error [rad]."""

APART, TURNED = 0.4, 8 * CLEAR_TURN
"""Scans are compared that lie so far apart [m], or turned so much [rad]: steps of less are as small as their errors."""

INDEPENDENT, ROUGHNESS = 6.0, 0.01
"""A scan counts as so many independent points, whose distances to the walls have this mean at least [m]."""

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
    """Scans in their order; two are compared when the robot has gone ``APART`` [m], or turned by ``TURNED``."""

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
            self._last, self._unseen = scan, False
            self._begin(scan)
            return SILENT
        last, unseen = self._last, self._unseen
        self._last, self._unseen = scan or last, scan is None
        if last is None:
            self._begin(scan)
            return SILENT
        if scan is not None and not unseen and abs(view.distance) < STILL and abs(view.turn) < STILL:
            return motion_ratios(last, scan, 0.0, 0.0)
        self._distance, self._turn = self._distance + view.distance, self._turn + view.turn
        if scan is None or (abs(self._distance) < APART and abs(self._turn) < TURNED):
            return SILENT
        found = motion_ratios(self._begun or last, scan, self._distance, self._turn)
        self._begin(scan)
        return found

    def _begin(self, scan: Scan | None) -> None:
        """Reckon the way from this scan on; without one the way goes on as before."""
        if scan is not None:
            self._begun, self._distance, self._turn = scan, 0.0, 0.0


def motion_ratios(before: Scan, after: Scan, distance: float, turn: float) -> MotionRatios:
    """Ratios of the hypotheses, given the odometer's ``distance`` [m] and ``turn`` [rad] between two scans."""
    pair = None if abs(distance) > FARTHEST_STEP else ScanPair.of(before, after)
    if pair is None:
        return SILENT
    if abs(turn) > LARGEST_TURN:
        return MotionRatios({}, carried=_spun(pair, distance, turn))
    if abs(distance) < STILL and abs(turn) < STILL:
        stands, moves = _stands_or_moves(pair)
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
    healthy, slipping, turned, halved, half_way, back, back_way = pair.unexplained(motions).tolist()
    ratios = {
        FaultKind.DOUBLED: _ratio(min(halved, half_way), healthy),
        FaultKind.REVERSED: _ratio(min(back, back_way), healthy),
        FaultKind.SLIPPING: _ratio(slipping, healthy),
    }
    mirrored = _ratio(turned, healthy) if abs(turn) > CLEAR_TURN else 0.0
    flipped = _ratio(pair.mirrored.unexplained([(distance, turn)]).item(), healthy)
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
    pair = ScanPair.of(before, after)
    if pair is None:
        return None
    stands, moves = _stands_or_moves(pair)
    return bounded(_ratio(min(moves, ELSEWHERE), stands))


def _stands_or_moves(pair: ScanPair) -> tuple[float, float]:
    """Unexplained [m] of a robot that stood, and the least of one that has gone some way straight on."""
    stands, *moves = pair.unexplained([(step, 0.0) for step in (0.0, *STEPS)]).tolist()
    return stands, min(moves)


def _spun(pair: ScanPair, distance: float, turn: float) -> float:
    """Log-likelihood ratio of a robot that went straight on or stood, a wheel spinning, against a turn, 0 or more.

    After a turn of half its field of view a laser sees too little of what it saw: then nobody can tell.
    """
    if abs(turn) > pair.walls.half_view:
        return 0.0
    ways = [(distance, turn), (0.0, turn), (distance, 0.0), (0.0, 0.0)]
    arc, on_the_spot, straight, stood = pair.unexplained(ways).tolist()
    return float(np.clip(_ratio(min(straight, stood), min(arc, on_the_spot)), 0.0, FOLLOWS))


def _ratio(fault: float, health: float) -> float:
    """Log-likelihood ratio of what two hypotheses leave unexplained [m]: distances are exponentially distributed."""
    return INDEPENDENT * (health - fault) / max(ROUGHNESS, min(health, fault))
