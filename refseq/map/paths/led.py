"""Behaviours of a drive that a person led: its straight legs, the turns between them, and the walls beside each.

Every leg is gone along with ``MN``, which is told how far off the walls were; between two legs ``MT`` turns the robot,
about itself or on the arc on which the person did. So a path that was led once is a mission as well (card X1, X3).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import reckoned_poses, way_along
from refseq.features.walls import WallSettings, find_lines
from refseq.inference.paths import usual_step
from refseq.map.paths.legs import Leg, legs_of
from refseq.planar import Pose, wrap
from refseq.view import Scan, View

LEAST_TURN = math.radians(3)
"""A smaller turn is left to the walls beside the next leg: a choice."""
WALLS = WallSettings(length=1.0)
"""Lines that are walls of a leg are so long: a choice, more than a cupboard is wide."""
BESIDE = -0.5, 2.5
"""Some of a wall has to be from so far behind the scanner to so far ahead of it [m]: a choice."""
PARALLEL = math.radians(12)
"""A wall is no more aslant against its leg than this: a choice."""
TIGHTEST, WIDEST = 0.5, 1.5
"""Arcs of corners have radii from the one to the other [m]: how tight a turn is that falls between two views nobody can
tell, and a wide one is left to the walls. Choices."""
GENTLE, REVERSAL = math.radians(20), math.radians(150)
"""A turn of less, or of more, is one about itself: how far it cut its corner cannot be told. Choices."""
NEAREST, FARTHEST = 0.3, 2.4
"""Distances of walls that are kept to [m]: choices, within what behaviours look for."""
AGREE, SUPPORT, FEWEST = 0.15, 0.5, 3
"""A leg has a wall where of its views at least the share ``SUPPORT``, and so many, see it at one distance, within
``AGREE`` [m], by which a person wanders to the side: choices."""
SHORTEST = 0.05
"""No way is told that is shorter than this [m]."""


@dataclass(frozen=True, slots=True)
class _Bend:
    """The turn between two legs: by ``angle`` [rad], on an arc of ``radius`` [m], 0: about itself."""

    angle: float
    radius: float

    @property
    def tangent(self) -> float:
        """Way from where the arc begins to the corner [m]."""
        return self.radius * math.tan(abs(self.angle) / 2) if self.radius else 0.0

    @property
    def words(self) -> str:
        """In a robot's words."""
        return f"MT:{math.degrees(self.angle):.1f}" + (f",{self.radius:.2f}" if self.radius else "")


def led_behaviours(views: Sequence[View]) -> tuple[str, ...]:
    """Behaviours from each view of a drive on, (K,), as ``Annotations`` hold them; () where nothing moved."""
    along = way_along(views)
    if len(views) < 2 or not along[-1] > 0:
        return ()
    poses = reckoned_poses(views)
    legs = legs_of(poses, along)
    walls = [_walls(leg, views, poses, along) for leg in legs]
    told: list[list[str]] = [[] for _ in views]
    view = 0
    for at, words in _moves(legs, walls, poses[0].heading, usual_step(along)):
        # A corner may lie farther along the leg before it than along the one behind it: their order stays.
        view = max(view, min(int(np.searchsorted(along, at, side="right")), len(along) - 1) - 1)
        told[view].append(f"{words}@{at - along[view]:.2f}")
    return tuple("; ".join(several) for several in told)


def _moves(legs: Sequence[Leg], walls: Sequence[str], heading: float, spacing: float) -> Iterator[tuple[float, str]]:
    """The turn onto each leg, if there is one, and the way along it: where it begins [m along], in a robot's words."""
    first, last = _Bend(wrap(legs[0].begins - heading), 0.0), _Bend(0.0, 0.0)
    bends = [first, *(_bend(one, other, spacing) for one, other in pairwise(legs)), last]
    at = legs[0].start
    for leg, beside, (onto, after) in zip(legs, walls, pairwise(bends), strict=True):
        if abs(onto.angle) > LEAST_TURN:
            yield at, onto.words
        start, at = leg.start + onto.tangent, leg.end - after.tangent
        if at - start > SHORTEST:
            yield start, f"MN:{at - start:.2f}{beside}"


def _bend(one: Leg, other: Leg, spacing: float) -> _Bend:
    """The turn from a leg to the next: its arc is as much shorter than the corner as the path was.

    Along both tangents an arc's corner is 2 r tan(φ/2) long, along the arc r φ. Between two views the odometer's turn
    is taken for one arc, so that a path that is sampled every ``spacing`` [m] looks smoother than it was: the variance
    of a turn's places is that of its arc, (r φ)²/12, and that of the sampling, spacing²/6.
    """
    angle = wrap(other.begins - one.ends)
    turned = abs(angle)
    if not GENTLE < turned < REVERSAL:
        return _Bend(angle, 0.0)
    half = math.tan(turned / 2)
    seen = max(one.end - other.start, 0.0) * turned / (2 * half - turned)
    radius = math.sqrt(max(seen**2 - 2 * spacing**2, 0.0)) / turned
    # No arc takes more than half of a leg.
    most = min(WIDEST, (one.end - one.start) / 2 / half, (other.end - other.start) / 2 / half)
    return _Bend(angle, min(max(radius, TIGHTEST), most) if most > TIGHTEST else 0.0)


def _walls(leg: Leg, views: Sequence[View], poses: Sequence[Pose], along: NDArray[np.float64]) -> str:
    """The distances of the walls to the left and the right of a leg, as ``MN`` is told them; 0: none."""
    inside = np.flatnonzero((along >= leg.start) & (along <= leg.end)).tolist()
    middle = (leg.begins + leg.ends) / 2
    scans = [(scan, middle - poses[k].heading) for k in inside if (scan := views[k].scan) is not None]
    found = [_beside(scan, heading) for scan, heading in scans]
    left, right = (_agreed([one[side] for one in found]) for side in (0, 1))
    return f",{left:.2f},{right:.2f}"


def _beside(scan: Scan, heading: float) -> tuple[float, float]:
    """Distances of the longest walls to the left and the right of a robot that goes to ``heading`` [m]; 0: none."""
    lines = find_lines(scan, WALLS)
    lines = lines[lines.length >= WALLS.length]
    ahead = np.array([math.cos(heading), math.sin(heading)])
    left = np.array([-ahead[1], ahead[0]])
    away = lines.centre @ left
    ends = np.sort(np.stack([lines.start @ ahead, lines.end @ ahead]), axis=0)
    beside = (np.abs(lines.direction @ left) < math.sin(PARALLEL)) & (ends[0] < BESIDE[1]) & (ends[1] > BESIDE[0])
    sides = []
    for side in (1, -1):
        fits = np.flatnonzero(beside & (side * away > 0) & (lines.distance > NEAREST) & (lines.distance < FARTHEST))
        sides.append(float(lines.distance[fits[lines.length[fits].argmax()]]) if len(fits) else 0.0)
    return sides[0], sides[1]


def _agreed(distances: Sequence[float]) -> float:
    """The distance that most views agree on [m]; 0 where too few do, or see a wall."""
    seen = np.array([distance for distance in distances if distance])
    agree = np.abs(seen[:, None] - seen) < AGREE
    if not len(seen) or agree.sum(axis=0).max() < max(SUPPORT * len(distances), FEWEST):
        return 0.0
    return float(np.median(seen[agree[agree.sum(axis=0).argmax()]]))
