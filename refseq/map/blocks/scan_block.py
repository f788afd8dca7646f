"""The scan as evidence: laid on the scans of the few likeliest places (docs/decisions/0054-scans-with-cameras.md).

A robot between two places sees less of what either of them showed than one that stands right at a place of some other
corridor like theirs, and view after view has the same distance to its places. So a scan's score is raised by what
scores fall by on the way to the next place, and the nearest of neighbours loses nothing for its distance.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import lru_cache, partial
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks.few_places import NO_PLACES, OPEN, beside, beyond_nearest, pairs_elsewhere
from refseq.map.map import Map
from refseq.map.poses_beside import PosesBeside
from refseq.pose_graph import motions_between
from refseq.scan_matching.fit import FARTHEST, LaidScan, ScanFit, fitted, laid_scan
from refseq.scan_matching.screen import Screen
from refseq.view import LASER

VIEWS, PLACES = 40, 5
"""So many views of the reference, spread evenly, are laid on so many places each: what a place elsewhere scores."""
MANY = 100
"""Where many places are screened, as many as this are for each of those views."""
NEAR = 0.4
"""Of places beside each other one counts less the farther along from it [m] the scan puts the robot than from the
nearest: by a factor of 0.6 so far off."""
STOOD = 0.05
"""A robot that has gone no farther [m] has stood, and saw the same."""
SURE = 2.0
"""So many standard deviations of what chance brings."""
NOTHING = -1.0
"""Score of a scan that does not lie on the place's at all."""


class ScanBlock:
    """Log-likelihood ratios by the fit of a view's scan, whose fits ``poses`` hold.

    ``most`` is how many places are asked: ``log_ratio.scans`` of the map's profile. Where the laser is all of the
    ``sensors`` that are asked it is ``log_ratio.scans_alone`` at least, or ``log_ratio.screened`` if any: then the scan
    is laid on those of them at which most of its beams meet walls, and counts as lying on no other.
    """

    blind = 0.0
    """A scan that shows walls is not blind, and rules out more than words may."""

    def __init__(self, map_: Map, poses: PosesBeside, sensors: Collection[str]) -> None:
        self._map, self._poses = map_, poses
        settings, alone = map_.profile.log_ratio, set(sensors) == {LASER}
        self.most = few_alone(map_) if alone else settings.scans
        self.screened = settings.screened if alone and self.most else 0

    @property
    def sees(self) -> bool:
        """True where the view's scan shows walls."""
        return self._poses.sees

    def log_ratios(self, places: NDArray[np.intp], screened: NDArray[np.intp] = NO_PLACES) -> NDArray[np.float64]:
        """Log-likelihood ratios of some places and of those ``screened``, (n,)."""
        known, every = self._map.once(known_scans), np.concatenate([places, screened])
        if not known.tells:
            return np.zeros(len(every))
        met = self._poses.most_met(every.tolist(), OPEN * self.most) if self.screened else []
        laid = [*places.tolist(), *met]
        fits = dict(zip(laid, self._poses.fits(laid), strict=True))
        its = [fits.get(place) for place in every.tolist()]
        told = self._told(scores(its, known.fall, known.half), len(places), np.isin(every, met))
        told -= beyond_nearest(far_along(its), beside(self._map, every))
        told[[not self._poses.shown(place) for place in every.tolist()]] = 0.0  # a drive whose laser was away
        return told

    def _told(self, its: NDArray[np.float64], named: int, met: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Ratios by scores (n,) of places, of which the first are ``named``, and of which some are ``met``.

        Of those named both ratios hold: by scores of places whatever met there, and of those where most is met. So
        does the mean of the two.
        """
        elsewhere = self._map.once(known_scans).elsewhere
        if not self.screened:
            return elsewhere.log_ratios(its)
        told = self._map.once(scores_screened).log_ratios(np.where(met, its, NOTHING))
        told[:named] = np.logaddexp(told[:named], elsewhere.log_ratios(its[:named])) - np.log(2)
        return told

    def brought(self, places: NDArray[np.intp]) -> Mapping[str, NDArray[np.float64]]:
        """Nothing: scans are compared with no others of the drive."""
        del places
        return {}


class KnownScans(NamedTuple):
    """Scores of a map's own scans: ``elsewhere`` are those of places that are not a view's, calibrated.

    They ``fall`` by so much on the way from place to place [1/m]. A robot on a path is no farther than ``half`` a
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
    laid = scans_of(map_)

    def fits(pairs: Iterable[tuple[int, int]], way: Callable[[int, int], NDArray[np.float64]]) -> list[ScanFit | None]:
        """Scans of views laid on those of places, of the pairs that have both, sought about the way there."""
        both = [
            (there, seen, way(place, view)) for view, place in pairs if (there := laid(place)) and (seen := laid(view))
        ]
        return fitted([pair[:2] for pair in both], np.array([about for _, _, about in both]).reshape(-1, 3))

    half = map_.usual_step / 2
    views = np.unique(np.linspace(1, len(map_) - 1, VIEWS).round().astype(int)) if len(map_) > 1 else np.zeros(0, int)
    in_a_row = [(view, view - 1) for view in views[map_.in_a_row(views, views - 1, 1)].tolist()]
    steps = fits(in_a_row, partial(beyond_reach, map_))
    fall = falls(steps)
    elsewhere = fits(pairs_elsewhere(map_, VIEWS, PLACES), lambda place, view: np.zeros(3))
    own, others = scores(steps, fall, half), scores(elsewhere, fall, half)
    return KnownScans(Calibration(others), fall, half, better(own, others))


def scores_screened(map_: Map) -> Calibration:
    """Scores elsewhere as views have them that are asked of many places, and laid on those where most is met."""
    known, told = map_.once(known_scans), [np.zeros(0)]
    laid = scans_of(map_)
    for view, pairs in groupby(pairs_elsewhere(map_, VIEWS, MANY), key=itemgetter(0)):
        places = [there for _, place in pairs if (there := laid(place))]
        if seen := laid(view):
            met = np.argsort(-Screen(seen).shares(places), kind="stable")[: OPEN * few_alone(map_)]
            its = np.full(len(places), NOTHING)
            its[met] = scores(fitted([(places[number], seen) for number in met]), known.fall, known.half)
            told.append(its)
    return Calibration(np.concatenate(told))


def scans_of(map_: Map) -> Callable[[int], LaidScan | None]:
    """Scans of a map's places, each made ready to be laid once; None for one that shows no walls."""
    return lru_cache(None)(lambda place: laid_scan(map_.scan(place)))


def few_alone(map_: Map) -> int:
    """On so many places a scan is laid where the laser is all that is asked; at a start on ``OPEN`` times as many."""
    settings = map_.profile.log_ratio
    return max(settings.scans, settings.scans_alone)


def beyond_reach(map_: Map, place: int, view: int) -> NDArray[np.float64]:
    """The way from a place to a view behind it by the odometer, (3,), where it leads farther than scans lie; or 0.

    Sought where it was not, no scan would lie on the one of the place before, and all would seem to tell nothing.
    """
    number = map_.sequence_of(view)
    its, first = map_.sequences[number].odometry, int(map_.first[number])
    way = motions_between(its[place - first], its[view - first]) if len(its) else np.zeros(3)
    return way if np.abs(way[:2]).max() > FARTHEST else np.zeros(3)


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


def far_along(fits: Sequence[ScanFit | None]) -> NDArray[np.float64]:
    """By how much places count less, as a logarithm, for how far along from them scans lie, (n,); infinite: nowhere."""
    return np.array([math.inf if fit is None else (fit.motion[0] / NEAR) ** 2 / 2 for fit in fits])
