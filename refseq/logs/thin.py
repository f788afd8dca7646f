"""Making a dense recording look like one of the bench's: fewer views, and the odometry of a real robot."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from refseq.behaviours import behaviours_kept
from refseq.dead_reckoning import way_along
from refseq.view import View


@dataclass(frozen=True, slots=True)
class OdometryNoise:
    """Standard deviations of Gaussian odometry noise.

    ``distance`` as a share of the distance, ``turn`` as a share of the turn, ``drift`` [rad/m]. The defaults are ten
    times better than CARMEN's own, as facts.md has it for a calibrated differential drive.
    """

    distance: float = 0.02
    turn: float = 0.02
    drift: float = 0.001


def with_odometry_noise(
    views: Sequence[View], rng: np.random.Generator, noise: OdometryNoise | None = None
) -> tuple[View, ...]:
    """The same views with noise on their distance and turn, for logs whose odometry was replaced by corrected poses."""
    noise = noise or OdometryNoise()
    errors = rng.standard_normal((len(views), 2))
    return tuple(
        replace(
            view,
            distance=view.distance * (1 + noise.distance * distance_error),
            turn=view.turn + turn_error * (noise.turn * abs(view.turn) + noise.drift * abs(view.distance)),
        )
        for view, (distance_error, turn_error) in zip(views, errors, strict=True)
    )


def every(views: Sequence[View], distance: float = 0.85, turn: float = math.inf) -> tuple[View, ...]:
    """Keep the first view, and then one whenever ``distance`` [m] or ``turn`` [rad] has been added up since the last.

    The motion of views that go is added to the next one that stays; behaviours told there are told at the one before.
    """
    return thinned(views, distance, turn)[1]


def thinned(views: Sequence[View], distance: float, turn: float = math.inf) -> tuple[list[int], tuple[View, ...]]:
    """Indices of the views that ``every`` keeps, and those views."""
    thinner = Thinner(distance, turn)
    found = [(number, one) for number, view in enumerate(views) if (one := thinner.take(view)) is not None]
    kept = [number for number, _ in found]
    return kept, _with_behaviours(views, kept, [one for _, one in found])


def chosen(views: Sequence[View], kept: Sequence[int]) -> tuple[View, ...]:
    """The views of some indices, rising; motion of the views between is added to the next of them.

    The first one has not moved, and behaviours told between are told at the one before, as with ``every``.
    """
    found: list[View] = []
    for before, number in pairwise([-1, *kept]):
        steps = views[before + 1 : number + 1] if found else ()
        moved, turned = sum(step.distance for step in steps), sum(step.turn for step in steps)
        found.append(replace(views[number], distance=float(moved), turn=float(turned)))
    return _with_behaviours(views, kept, found)


def _with_behaviours(views: Sequence[View], kept: Sequence[int], thinned: Sequence[View]) -> tuple[View, ...]:
    """The ``thinned`` views, which are those ``kept``, with the behaviours told at all views."""
    told = [view.behaviour for view in views]
    if not any(told):
        return tuple(thinned)
    words = behaviours_kept(told, way_along(views), kept)
    return tuple(replace(view, behaviour=one) for view, one in zip(thinned, words, strict=True))


class Thinner:
    """Keeps one view after the other, as ``every`` does, or not; behaviours told at views that go are not kept."""

    def __init__(self, distance: float, turn: float = math.inf) -> None:
        self._distance, self._turn = distance, turn
        self._moved = self._turned = 0.0
        self._kept = False

    def take(self, view: View) -> View | None:
        """The view with the motion since the last that was kept; None where that is too little."""
        self._moved, self._turned = self._moved + view.distance, self._turned + view.turn
        if self._kept and abs(self._moved) < self._distance and abs(self._turned) < self._turn:
            return None
        moved, turned = (self._moved, self._turned) if self._kept else (0.0, 0.0)
        there = replace(view, distance=moved, turn=turned)
        self._kept, self._moved, self._turned = True, 0.0, 0.0
        return there
