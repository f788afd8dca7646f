"""Behaviours of a drive that a person led: its straight legs, the turns between them, and the walls beside each.

Every leg is gone along with ``MN``, which is told how far off the walls were; between two legs ``MT`` turns the robot
about itself. So a path that was led once is a mission as well (card X1, X3).
"""

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.features.walls import WallSettings, find_lines
from refseq.map.legs import Leg, legs_of
from refseq.planar import Pose, after_motion, wrap
from refseq.view import Scan, View

LEAST_TURN = math.radians(3)
"""A smaller turn is left to the walls beside the next leg: a choice."""
WALLS = WallSettings(length=1.0)
"""Lines that are walls of a leg are so long: a choice, more than a cupboard is wide."""
BESIDE = -0.5, 2.5
"""Some of a wall has to be from so far behind the scanner to so far ahead of it [m]: a choice."""
PARALLEL = math.radians(12)
"""A wall is no more aslant against its leg than this: a choice."""
NEAREST, FARTHEST = 0.3, 2.4
"""Distances of walls that are kept to [m]: choices, within what behaviours look for."""
AGREE, SUPPORT, FEWEST = 0.15, 0.5, 3
"""A leg has a wall where of its views at least the share ``SUPPORT``, and so many, see it at one distance, within
``AGREE`` [m], by which a person wanders to the side: choices."""
SHORTEST = 0.05
"""No way is told that is shorter than this [m]."""


@dataclass(frozen=True, slots=True)
class _Move:
    """A behaviour that begins ``at`` [m along the path]; if it ``travels``, ``words`` are those behind its length."""

    at: float
    words: str
    travels: bool

    def over(self, length: float) -> str:
        """In a robot's words, for a way of ``length`` [m] where it travels."""
        return f"MN:{max(length, SHORTEST):.2f}{self.words}" if self.travels else self.words


def led_behaviours(views: Sequence[View]) -> tuple[str, ...]:
    """Behaviours from each view of a drive on, (K,): several are one behind the other; () where nothing moved.

    Those before the last of a view are as long as they say; the last one begins as far before the next view as it says,
    for where a path cuts a corner it is shorter than its legs.
    """
    along = np.cumsum([0.0] + [abs(view.distance) for view in views[1:]])
    if len(views) < 2 or not along[-1] > 0:
        return ()
    poses = list(
        accumulate(views[1:], lambda at, view: after_motion(at, view.distance, view.turn), initial=Pose(0.0, 0.0, 0.0))
    )
    legs = legs_of(poses, along)
    moves = list(_moves(legs, [_walls(leg, views, poses, along) for leg in legs], poses[0].heading))
    return _by_view(moves, along.tolist())


def _moves(legs: Sequence[Leg], walls: Sequence[str], heading: float) -> Iterator[list[_Move]]:
    """The moves of each leg: the turn onto it, if there is one, and the way along it."""
    at = 0.0
    for leg, beside in zip(legs, walls, strict=True):
        turn = wrap(leg.begins - heading)
        onto = [_Move(at, f"MT:{math.degrees(turn):.1f}", travels=False)] if abs(turn) > LEAST_TURN else []
        yield [*onto, _Move(leg.start, beside, travels=True)]
        at, heading = leg.end, leg.ends


def _by_view(legs: Sequence[list[_Move]], along: Sequence[float]) -> tuple[str, ...]:
    """The moves as words of the view before each; where it lies ahead of that, the way to it is told first."""
    begun: dict[int, list[_Move]] = {}
    view = 0
    for moves in legs:
        view = max(view, min(bisect_right(along, moves[0].at), len(along) - 1) - 1)
        begun.setdefault(view, []).extend(moves)
    told, before = [""] * len(along), legs[0][-1]
    ends = [*(moves[0].at for moves in begun.values()), along[-1]][1:]
    for (view, moves), end in zip(begun.items(), ends, strict=True):
        words = [before.over(moves[0].at - along[view])] if moves[0].at - along[view] > SHORTEST else []
        words += [move.over(after.at - move.at) for move, after in pairwise(moves)]
        told[view] = " ".join([*words, moves[-1].over((along[view + 1] if words else end) - moves[-1].at)])
        before = moves[-1]
    return tuple(told)


def _walls(leg: Leg, views: Sequence[View], poses: Sequence[Pose], along: NDArray[np.float64]) -> str:
    """The distances of the walls to the left and the right of a leg, as ``MN`` is told them; empty without any."""
    inside = np.flatnonzero((along >= leg.start) & (along <= leg.end)).tolist()
    middle = (leg.begins + leg.ends) / 2
    scans = [(scan, middle - poses[k].heading) for k in inside if (scan := views[k].scan) is not None]
    found = [_beside(scan, heading) for scan, heading in scans]
    left, right = (_agreed([one[side] for one in found]) for side in (0, 1))
    return f",{left:.2f},{right:.2f}" if left or right else ""


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
