"""Geometry as evidence: a view's keys laid on those of the few likeliest places (docs/decisions/0040-keys-that-fit.md).

Words count which keys a place shares with the view. The fit tells whether they lie as they did there: given how many
match, it is told how many of them fit.

Keys that fit speak for a place, those that do not never against it (docs/decisions/0049-fits-speak-for.md). In another
light than the map's most keys of a picture may be noise, which fits nowhere, the robot's own place among them.
"""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.features.key_fit import KeyFit, fit_keys
from refseq.features.word_extractor import PictureKeys
from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks.few_places import NO_PLACES, beside, beyond_nearest, pairs_elsewhere
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
FARTHEST = 2.0
"""A place counts less than its neighbours by no more than this, as a logarithm, and by that where no keys fit."""


class KeyBlock:
    """Log-likelihood ratios by the fit of a view's keys, all its cameras together.

    ``most``, ``log_ratio.geometry`` of the map's profile, is how many places keys are laid on.
    """

    screened = 0
    """Places that words do not name are not looked through: with pictures words name the right one."""

    def __init__(self, map_: Map) -> None:
        self._map = map_
        self.take({})
        self._calibrations: dict[frozenset[str], Calibration] = {}
        settings = map_.profile.log_ratio
        self.most, self.blind = int(settings.geometry), settings.blind

    def take(self, view: Mapping[str, PictureKeys]) -> None:
        """Take the next view's keys, by camera."""
        self._view, self._fits = view, dict[int, Mapping[str, KeyFit]]()

    @property
    def sees(self) -> bool:
        """True where any camera shows keys."""
        return any(len(keys.points) for keys in self._view.values())

    def log_ratios(self, places: NDArray[np.intp], screened: NDArray[np.intp] = NO_PLACES) -> NDArray[np.float64]:
        """Log-likelihood ratios of some places, (n,), 0 or more; none are ``screened``."""
        del screened
        fits = self._together(places, self._view)
        zoom = np.array([np.log(fit.scale) if fit.inliers else np.inf for fit in fits])
        return shared(beside(self._map, places), np.maximum(self._ratios(self._view, fits), 0.0), zoom)

    def brought(self, places: NDArray[np.intp]) -> Mapping[str, NDArray[np.float64]]:
        """Log ratios of the best fit beside each of some places, (n,), of each camera for itself, below 0 as well.

        How well keys fit where the robot was, in the light that there is, the drive's own views tell.
        """
        near = beside(self._map, places)
        ratios = {camera: self._ratios([camera], self._together(places, [camera])) for camera in self._view}
        return {f"keys/{camera}": np.where(near, told, -np.inf).max(axis=1) for camera, told in ratios.items()}

    def _together(self, places: NDArray[np.intp], cameras: Collection[str]) -> list[KeyFit]:
        """The view's keys laid on those of some places, by some cameras together; once, for all that ask."""
        for place in places.tolist():
            if place not in self._fits:
                self._fits[place] = laid(self._map.keys(place), self._view)
        return [together(_of(self._fits[place], cameras)) for place in places.tolist()]

    def _ratios(self, cameras: Collection[str], fits: Sequence[KeyFit]) -> NDArray[np.float64]:
        """Log-likelihood ratios of fits by some cameras, (n,): 0 where too few keys match."""
        chosen = frozenset(cameras)
        if chosen not in self._calibrations:
            self._calibrations[chosen] = self._calibration(chosen)
        ratios = self._calibrations[chosen].log_ratios(np.array([score(fit) for fit in fits]))
        ratios[[fit.matches < FEWEST for fit in fits]] = 0.0
        return ratios

    def _calibration(self, cameras: Collection[str]) -> Calibration:
        """Scores of places elsewhere, by the keys of some cameras at the reference's own views."""
        fits = [together(_of(pair, cameras)) for pair in self._map.once(keys_elsewhere)]
        scores = np.array([score(fit) for fit in fits if fit.matches >= FEWEST])
        return Calibration(scores, tail=self._map.profile.log_ratio.tail)


def _of(fits: Mapping[str, KeyFit], cameras: Collection[str]) -> dict[str, KeyFit]:
    return {camera: fit for camera, fit in fits.items() if camera in cameras}


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


def shared(
    beside: NDArray[np.bool_], log_ratios: NDArray[np.float64], zoom: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Ratios of places (n,), 0 or more, of which those ``beside`` (n, n) each other show one wall.

    How well keys fit tells the wall: each place has the best fit of its neighbours. Which of them is the robot's, the
    ``zoom`` (n,) tells: a place counts less by as much as the view shows it larger or smaller, as a logarithm; infinite
    where nothing fits.
    """
    farther = np.minimum(np.square(zoom / ZOOM) / 2, FARTHEST)
    best = np.where(beside, log_ratios, 0.0).max(axis=1, initial=0.0)
    ratios: NDArray[np.float64] = np.maximum(best - beyond_nearest(farther, beside), 0.0)
    return ratios
