"""The scan as evidence: laid on the scans of the few likeliest places (docs/decisions/0033-the-scan-as-a-scan.md)."""

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks.few_places import pairs_elsewhere
from refseq.map.map import Map
from refseq.map.poses_beside import PosesBeside
from refseq.scan_matching.fit import LaidScan, fitted, laid_scan
from refseq.view import LASER

VIEWS, PLACES = 40, 5
"""So many views of the reference, spread evenly, are laid on so many places each: what a place elsewhere scores."""
NEAR = 0.4
"""A place counts less the farther along from it [m] the scan puts the robot: by a factor of 0.6 so far off."""
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
        calibration = self._map.once(scans_elsewhere)
        told = calibration.log_ratios(np.array([self._score(place) for place in places.tolist()]))
        told -= np.square([self._off(place) / NEAR for place in places.tolist()]) / 2
        told[[not self._poses.shown(place) for place in places.tolist()]] = 0.0  # a drive whose laser was away
        return told

    def brought(self, places: NDArray[np.intp]) -> Mapping[str, NDArray[np.float64]]:
        """Nothing: scans are compared with no others of the drive."""
        del places
        return {}

    def _off(self, place: int) -> float:
        """Distance along from a place to where the fit puts the robot [m]: neighbours see the same walls."""
        fit = self._poses.fit(place)
        return 0.0 if fit is None else float(fit.motion[0])

    def _score(self, place: int) -> float:
        fit = self._poses.fit(place)
        return NOTHING if fit is None else fit.score


def scans_elsewhere(map_: Map) -> Calibration:
    """Scores of scans at places that are not theirs, by the reference's own scans."""
    scans: dict[int, LaidScan | None] = {}
    scores = []
    for view, place in pairs_elsewhere(map_, VIEWS, PLACES):
        for one in (view, place):
            if one not in scans:
                scans[one] = laid_scan(map_.scan(one))
        seen, there = scans[view], scans[place]
        if seen is not None and there is not None:
            fit = fitted(there, seen)
            scores.append(NOTHING if fit is None else fit.score)
    return Calibration(np.array(scores))
