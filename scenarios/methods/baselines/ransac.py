"""The place that most keys of a view fit geometrically, each view for itself."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Timings
from refseq.errors import MapError
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import answer
from refseq_bench.scenarios.methods.baselines.matches import NO_KEYS, ImageKeys, KeyTable, Matches, SparseSift

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference

SAMPLE = 4
"""Pairs of points that any homography can be laid through: only more than these can agree."""


@dataclass(frozen=True, slots=True)
class RansacSettings:
    """Parameters of the matching, and of what it is worth.

    ``contrast`` is that of ``SparseSift``, ``ratio`` that of ``KeyTable.matches``. A pair agrees with a homography
    when it maps one within ``reach`` [pixels] of the other, and the search stops when it is ``confidence`` sure to have
    drawn one good sample, after ``rounds`` at the latest. A place is e times as likely for each ``worth`` inliers more:
    this shapes the belief, not the answer. With ``needed`` inliers at the best place it is even odds that the view is
    of a place; how much that tells grows with the view's keys, by half with the first ``keys`` of them.

    Set in the annex: ``reach``, ``worth``, ``needed`` and ``keys``.
    """

    contrast: float = 0.02
    ratio: float = 0.8
    reach: float = 6.0
    confidence: float = 0.99
    rounds: int = 1000
    worth: float = 4.0
    needed: float = 16.0
    keys: float = 50.0


class RansacInliers:
    """Image retrieval by geometry: the place with the most keys that move as one plane does, over all cameras.

    A camera's matches with a place count as many as agree with the best homography that RANSAC finds (M. Fischler, R.
    Bolles, CACM 24(6), 1981; here OpenCV's USAC with a seed of its own, always the same). It is looked for at every
    place with more than ``SAMPLE`` matches, so that none is left out that could count. A homography that no more than
    its sample agrees with counts nothing. A fundamental matrix, which would allow for more than one plane, leaves so
    much room along its lines that it was right less often in the annex, within 0.5 m above all.

    Where no place has an inlier, all are as likely. That may be because the robot is elsewhere, or because the view
    shows nothing: the probability of being lost goes from ½ with no keys to near 1 with many.
    """

    def __init__(self, tables: dict[str, KeyTable], settings: RansacSettings) -> None:
        self._tables = tables
        self._settings = settings
        self._sift = SparseSift(settings.contrast)
        self._usac = _usac(settings)

    @classmethod
    def learn(cls, views: Sequence[View], settings: RansacSettings | None = None) -> "RansacInliers":
        """Find the keys of all views. Raises ``MapError`` when no view has an image."""
        settings = settings or RansacSettings()
        sift = SparseSift(settings.contrast)
        cameras = sorted({camera for view in views for camera in view.images})
        if not cameras:
            raise MapError(f"{len(views)} views show nothing to match; valid is a drive with images")
        tables = {camera: KeyTable([_keys(sift, view, camera) for view in views]) for camera in cameras}
        return cls(tables, settings)

    def reset(self) -> None:
        """Do nothing: views are not remembered."""

    def update(self, view: View) -> Belief:
        """Match with all places."""
        start = time.perf_counter()
        keys = {camera: _keys(self._sift, view, camera) for camera in self._tables}
        middle = time.perf_counter()
        inliers = self.inliers(keys)
        weights = np.exp((inliers - inliers.max()) / self._settings.worth)
        lost = self._lost(float(inliers.max()), sum(len(found) for found in keys.values()))
        return answer(weights, lost, Timings(middle - start, time.perf_counter() - middle))

    def inliers(self, keys: dict[str, ImageKeys]) -> NDArray[np.float64]:
        """Inliers at each place, all cameras together, (K,)."""
        counts = np.zeros(len(next(iter(self._tables.values()))))
        for camera, found in keys.items():
            for place, matches in self._tables[camera].matches(found, self._settings.ratio):
                counts[place] += count_inliers(matches, self._usac)
        return counts

    def _lost(self, inliers: float, keys: int) -> float:
        settings = self._settings
        none = settings.needed / (settings.needed + inliers)
        share = keys / (keys + settings.keys)
        return (1 - share) / 2 + share * none


def count_inliers(matches: Matches, usac: cv2.UsacParams) -> int:
    """Count the matches that agree with the homography that most agree with; 0 where no more than any ``SAMPLE`` do."""
    if len(matches) <= SAMPLE:
        return 0
    _, agree = cv2.findHomography(matches.place, matches.view, usac)
    inliers = 0 if agree is None else int(np.count_nonzero(agree))
    return inliers if inliers > SAMPLE else 0


def _usac(settings: RansacSettings) -> cv2.UsacParams:
    usac = cv2.UsacParams()
    usac.threshold, usac.confidence, usac.maxIterations = settings.reach, settings.confidence, settings.rounds
    usac.sampler, usac.score, usac.loMethod = cv2.SAMPLING_UNIFORM, cv2.SCORE_METHOD_MSAC, cv2.LOCAL_OPTIM_INNER_LO
    usac.isParallel, usac.randomGeneratorState = False, 1
    return usac


def _keys(sift: SparseSift, view: View, camera: str) -> ImageKeys:
    return sift(view.images[camera]) if camera in view.images else NO_KEYS


def learnt(reference: "Reference") -> RansacInliers:
    """The method, once it has learnt a reference drive."""
    return RansacInliers.learn(reference.views)
