"""The scan as evidence: laid on the scans of the few likeliest places (docs/decisions/0054-scans-with-cameras.md).

A robot between two places sees less of what either of them showed than one that stands right at a place of some other
corridor like theirs, and view after view has the same distance to its places. So a scan's score is raised by what
scores fall by on the way to the next place, and the nearest of neighbours loses nothing for its distance.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.log_ratio import Calibration
from refseq.inference.paths import usual_step
from refseq.map.blocks.few_places import pairs_elsewhere
from refseq.map.map import Map
from refseq.map.poses_beside import PosesBeside
from refseq.scan_matching.fit import ScanFit, fitted, laid_scan
from refseq.view import LASER

VIEWS, PLACES = 40, 5
"""So many views of the reference, spread evenly, are laid on so many places each: what a place elsewhere scores."""
NEAR = 0.4
"""Of places beside each other one counts less the farther along from it [m] the scan puts the robot than from the
nearest: by a factor of 0.6 so far off."""
BESIDE = 2
"""Places learnt so many views of a path apart are beside each other, and see the same walls."""
STOOD = 0.05
"""A robot that has gone no farther [m] has stood, and saw the same."""
SURE = 2.0
"""So many standard deviations of what chance brings."""
NOTHING = -1.0
"""Score of a scan that does not lie on the place's at all."""


class ScanBlock:
    """Log-likelihood ratios by the fit of a view's scan, whose fits ``poses`` hold.

    ``most`` is how many places a scan is laid on: ``log_ratio.scans`` of the map's profile, and where the laser is all
    of the ``sensors`` that are asked, ``log_ratio.scans_alone`` at least.
    """

    blind = 0.0
    """A scan that shows walls is not blind, and rules out more than words may."""

    def __init__(self, map_: Map, poses: PosesBeside, sensors: Collection[str]) -> None:
        self._map, self._poses = map_, poses
        settings = map_.profile.log_ratio
        self.most = max(settings.scans, settings.scans_alone) if set(sensors) == {LASER} else settings.scans

    @property
    def sees(self) -> bool:
        """True where the view's scan shows walls."""
        return self._poses.sees

    def log_ratios(self, places: NDArray[np.intp]) -> NDArray[np.float64]:
        """Log-likelihood ratios of some places, (n,)."""
        known = self._map.once(known_scans)
        if not known.tells:
            return np.zeros(len(places))
        fits = [self._poses.fit(place) for place in places.tolist()]
        told = known.elsewhere.log_ratios(scores(fits, known.fall, known.half))
        told -= farther(fits, self._map.in_a_row(places[:, None], places, BESIDE))
        told[[not self._poses.shown(place) for place in places.tolist()]] = 0.0  # a drive whose laser was away
        return told

    def brought(self, places: NDArray[np.intp]) -> Mapping[str, NDArray[np.float64]]:
        """Nothing: scans are compared with no others of the drive."""
        del places
        return {}


class KnownScans(NamedTuple):
    """What a map's own scans tell of scores: ``elsewhere`` those of places that are not a view's, calibrated.

    Scores ``fall`` by so much on the way from place to place [1/m]. A robot on a path is no farther than ``half`` a
    step [m] from the nearest, so that none is raised by more than that. ``tells`` is False where the reference's own
    scans score no better a step on than elsewhere: along a bare corridor a ratio is chance, which on the mean speaks
    against the robot's place as against any.
    """

    elsewhere: Calibration
    fall: float
    half: float
    tells: bool


def known_scans(map_: Map) -> KnownScans:
    """By the reference's own scans: some laid on those of places far from them, some on the place before them."""
    laid = lru_cache(None)(lambda place: laid_scan(map_.scan(place)))

    def fit(view: int, place: int) -> ScanFit | None:
        seen, there = laid(view), laid(place)
        return None if seen is None or there is None else fitted(there, seen)

    far = [pair for pair in pairs_elsewhere(map_, VIEWS, PLACES) if all(laid(one) is not None for one in pair)]
    ends = tuple((map_.first[1:] - 1).tolist())
    half = usual_step(np.concatenate([sequence.along for sequence in map_.sequences]), ends) / 2
    views = np.unique(np.linspace(1, len(map_) - 1, VIEWS).round().astype(int)) if len(map_) > 1 else np.zeros(0, int)
    steps = [fit(view, view - 1) for view in views[map_.in_a_row(views, views - 1, 1)].tolist()]
    fall = falls(steps)
    own, others = scores(steps, fall, half), scores([fit(*pair) for pair in far], fall, half)
    return KnownScans(Calibration(others), fall, half, better(own, others))


def better(own: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """True where ``own`` scores are higher than ``others`` by more than chance, by the test of Mann and Whitney.

    Of fewer than two nothing is known.
    """
    if min(len(own), len(others)) < 2:
        return True
    n, m, others = len(own), len(others), np.sort(others)
    lower = (np.searchsorted(others, own) + np.searchsorted(others, own, side="right")) / 2  # a tie is half of one
    return bool(lower.mean() / m - 0.5 > SURE * math.sqrt((n + m + 1) / (12 * n * m)))


def falls(fits: Sequence[ScanFit | None]) -> float:
    """By how much scores fall on the way from a place to a view behind it [1/m], the median of such ``fits``; or 0."""
    ways = [(1.0 - fit.score) / way for fit in fits if fit is not None and (way := abs(fit.motion[0])) > STOOD]
    return float(np.median(ways)) if ways else 0.0


def scores(fits: Sequence[ScanFit | None], fall: float, half: float) -> NDArray[np.float64]:
    """Scores of scans, (n,), as they would be had the robot stood right at the places."""
    return np.array([NOTHING if fit is None else fit.score + fall * min(abs(fit.motion[0]), half) for fit in fits])


def farther(fits: Sequence[ScanFit | None], beside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """By how much less places count than the nearest of those ``beside`` (n, n) each of them, (n,), as a logarithm."""
    off = np.array([math.inf if fit is None else (fit.motion[0] / NEAR) ** 2 / 2 for fit in fits])
    nearest = np.where(beside, off, math.inf).min(axis=1, initial=math.inf)
    lost: NDArray[np.float64] = np.subtract(off, nearest, out=np.zeros(len(off)), where=np.isfinite(off))
    return lost
