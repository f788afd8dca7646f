"""The scan as evidence: laid on the scans of the few likeliest places (docs/decisions/0033-the-scan-as-a-scan.md).

A calibrated block beside those of the words (``refseq.inference.matching.log_ratio``): the fit's score is read by those
of reference views at places far from them. A place that no scan is laid on gets a ratio of 1.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from refseq.belief import LOST_ABOVE, Belief
from refseq.inference.matching.log_ratio import Calibration
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.poses_beside import PosesBeside
from refseq.scan_matching.fit import LaidScan, fitted

VIEWS, PLACES = 40, 5
"""So many views of the reference, spread evenly, are laid on so many places each: what a place elsewhere scores."""
EXPECTED = 3
"""So many of the places are those that the last belief thought likeliest, the others the words'."""
OPEN = 2
"""So many times as many places are asked where the robot may be anywhere: at a start, and while it is lost."""
NEAR = 0.4
"""A place counts less the farther along from it [m] the scan puts the robot: by a factor of 0.6 so far off."""
NOTHING = -1.0
"""Score of a scan that does not lie on the place's at all."""


class ScanBlock:
    """Adds the scan's log-likelihood ratios to those of words, view by view; ``poses`` hold the view's fits.

    ``log_ratio.scans`` of the map's profile is how many places a scan is laid on; with 0 measurements stay as they are.
    """

    def __init__(self, map_: Map, poses: PosesBeside) -> None:
        self._map, self._poses = map_, poses
        self._most = int(map_.profile.log_ratio.scans)

    def weighed(self, measured: Sequence[Measurement], last: Belief | None) -> list[Measurement]:
        """Measurements with the scan's evidence; ``last`` is the belief on the view before, where it is a prior."""
        words = [one.log_ratio for one in measured if one.log_ratio is not None]
        if not self._most or len(words) < len(measured) or not self._poses.sees:
            return list(measured)
        ratios = np.concatenate(words)
        start = time.perf_counter()
        places = self._places(ratios, last, measured[0].distance)
        told = self._calibration.log_ratios(np.array([self._score(place) for place in places.tolist()]))
        ratios[places] += told - np.square([self._off(place) / NEAR for place in places.tolist()]) / 2
        parts = np.split(ratios, self._map.first[1:-1])
        weighed = [
            replace(one, log_ratio=part, likelihood=softmax(part)) for one, part in zip(measured, parts, strict=True)
        ]
        timings = weighed[0].timings
        spent = timings.matching + time.perf_counter() - start
        return [replace(weighed[0], timings=replace(timings, matching=spent)), *weighed[1:]]

    def _moved(self, places: NDArray[np.float64], distance: float) -> NDArray[np.float64]:
        """The last belief, carried on by the odometer along each sequence."""
        if not np.isfinite(distance):
            return places
        shares = np.split(places, self._map.first[1:-1])
        return np.concatenate(
            [
                np.interp(sequence.along - distance, sequence.along, share, left=0.0, right=0.0)
                for sequence, share in zip(self._map.sequences, shares, strict=True)
            ]
        )

    def _places(self, ratios: NDArray[np.float64], last: Belief | None, distance: float) -> NDArray[np.intp]:
        """The places that the scan is laid on: likeliest by the words of this view, and where it is expected."""
        most = self._most if last is not None and last.lost <= LOST_ABOVE else OPEN * self._most
        by_words = np.argsort(-ratios, kind="stable")[:most]
        if last is None:
            return by_words
        many = min(EXPECTED, most // 2)
        expected = np.argsort(-self._moved(last.places, distance), kind="stable")[:many]
        return np.union1d(by_words[: most - many], expected)

    def _off(self, place: int) -> float:
        """Distance along from a place to where the fit puts the robot [m]: neighbours see the same walls."""
        fit = self._poses.fit(place)
        return 0.0 if fit is None else float(fit.motion[0])

    def _score(self, place: int) -> float:
        fit = self._poses.fit(place)
        return NOTHING if fit is None else fit.score

    @cached_property
    def _calibration(self) -> Calibration:
        """Scores of places elsewhere, by the reference's own scans."""
        rng, apart = np.random.default_rng(0), self._map.profile.log_ratio.apart
        scores = []
        for first, sequence in zip(self._map.first[:-1].tolist(), self._map.sequences, strict=True):
            kept = [self._map.scan(first + place) for place in range(len(sequence))]
            scans = [None if one is None else LaidScan(one / 100.0) for one in kept]
            for view in np.unique(np.linspace(0, len(scans) - 1, VIEWS).round().astype(int)):
                far = np.flatnonzero(np.abs(sequence.along - sequence.along[view]) > apart)
                for place in rng.choice(far, min(PLACES, len(far)), replace=False):
                    one, other = scans[place], scans[view]
                    if one is not None and other is not None:
                        fit = fitted(one, other)
                        scores.append(NOTHING if fit is None else fit.score)
        return Calibration(np.array(scores))
