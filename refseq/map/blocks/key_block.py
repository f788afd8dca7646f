"""Geometry as evidence: a view's keys laid on those of the few likeliest places (docs/decisions/0040-keys-that-fit.md).

Words count which keys a place shares with the view. The fit tells whether they lie as they did there: given how many
match, it is told how many of them fit. That share does not depend on light, which takes matches away at all places.
"""

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from refseq.features.key_fit import KeyFit, fit_keys
from refseq.features.word_extractor import PictureKeys
from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks.few_places import pairs_elsewhere
from refseq.map.map import Map

VIEWS, PLACES = 100, 8
"""So many views of the reference, spread evenly, are laid on so many places each: what a place elsewhere scores."""
FEWEST = 6
"""Fewer matches tell nothing, for or against: a place that shows nothing to fit is neither likely nor unlikely."""
PRIOR = 8.0
"""So many matches that do not fit are added to those of each place: of few, a large share is worth less."""
ZOOM = 0.1
"""Of places beside each other one counts less the larger or smaller it is seen: by a factor of 0.6 for so much, as a
logarithm."""
BESIDE = 2
"""Places so many numbers apart are beside each other."""


class KeyBlock:
    """Log-likelihood ratios by the fit of a view's keys, all its cameras together.

    ``most``, ``log_ratio.geometry`` of the map's profile, is how many places keys are laid on; it is
    ``log_ratio.geometry_alone`` where one of the ``sensors`` alone is asked.
    """

    def __init__(self, map_: Map, sensors: Collection[str]) -> None:
        self._map = map_
        self.take({})
        self._calibrations: dict[frozenset[str], Calibration] = {}
        settings = map_.profile.log_ratio
        self.most = int(settings.geometry_alone if len(sensors) == 1 else settings.geometry)
        self.blind = settings.blind

    def take(self, view: Mapping[str, PictureKeys]) -> None:
        """Take the next view's keys, by camera."""
        self._view, self._fits = view, dict[int, KeyFit]()

    @property
    def sees(self) -> bool:
        """True where any camera shows keys."""
        return any(len(keys.points) for keys in self._view.values())

    def told(self, places: NDArray[np.intp]) -> NDArray[np.float64]:
        """Log-likelihood ratios of some places, (n,): 0 where too few keys match."""
        cameras = frozenset(self._view)
        if cameras not in self._calibrations:
            self._calibrations[cameras] = self._calibration(cameras)
        fits = [self._fit(place) for place in places.tolist()]
        told = self._calibrations[cameras].log_ratios(np.array([score(fit) for fit in fits]))
        told[[fit.matches < FEWEST for fit in fits]] = 0.0
        return nearest_of_neighbours(places, told, np.log([fit.scale for fit in fits]))

    def _fit(self, place: int) -> KeyFit:
        """The view's keys laid on a place's, for all stages that ask."""
        if place not in self._fits:
            self._fits[place] = together(laid(self._map.keys(place), self._view))
        return self._fits[place]

    def _calibration(self, cameras: frozenset[str]) -> Calibration:
        """Scores of places elsewhere, by the keys of some cameras at the reference's own views."""
        pairs = self._map.once(keys_elsewhere)
        fits = [together({camera: fit for camera, fit in pair.items() if camera in cameras}) for pair in pairs]
        return Calibration(np.array([score(fit) for fit in fits if fit.matches >= FEWEST]))


def keys_elsewhere(map_: Map) -> list[dict[str, KeyFit]]:
    """Views of the reference laid on places far from them, by camera."""
    return [laid(map_.keys(place), map_.keys(view)) for view, place in pairs_elsewhere(map_, VIEWS, PLACES)]


def laid(place: Mapping[str, PictureKeys], view: Mapping[str, PictureKeys]) -> dict[str, KeyFit]:
    """A view's keys laid on a place's, by camera; a camera that one of them lacks has none."""
    return {camera: fit_keys(place[camera], keys) for camera, keys in view.items() if camera in place}


def together(fits: Mapping[str, KeyFit]) -> KeyFit:
    """All cameras as one: sums, and the mean of their scales' logarithms, by inliers."""
    inliers = sum(fit.inliers for fit in fits.values())
    zoom = sum(fit.inliers * np.log(fit.scale) for fit in fits.values()) / max(inliers, 1)
    return KeyFit(sum(fit.matches for fit in fits.values()), inliers, float(np.exp(zoom)))


def score(fit: KeyFit) -> float:
    """Share of the matches that fit."""
    return fit.inliers / (fit.matches + PRIOR)


def nearest_of_neighbours(
    places: NDArray[np.intp], log_ratios: NDArray[np.float64], zoom: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Ratios of places (n,) of which those count less whose neighbours are seen more nearly as large as they were.

    Only what speaks for a place is taken away, so that places elsewhere average no more than before.
    """
    speaks = np.flatnonzero(log_ratios > 0)
    penalty = np.square(np.clip(zoom[speaks] / ZOOM, -2, 2)) / 2
    beside = np.abs(places[speaks, None] - places[speaks]) <= BESIDE
    least = np.where(beside, penalty, np.inf).min(axis=1, initial=np.inf)
    told = log_ratios.copy()
    told[speaks] = np.maximum(told[speaks] - (penalty - least), 0.0)
    return told
