"""Bags of words, which FAB-MAP takes views for: which words of a camera's vocabulary a view shows."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from refseq.errors import MapError
from refseq.features import Observed, SiftWords
from refseq.features.sift import SiftSettings
from refseq.map.profile import BEST
from refseq.view import View

WORDS = BEST.sift
"""Keys and words as in our own profile ``best``: in the annex better than the thesis' by 5 to 10 % of the views."""


@dataclass(frozen=True, slots=True)
class Bags:
    """One camera's words at the places: ``seen`` (K, N), zeros and ones, and whether a place ``has`` the camera (K,).

    N may be 0, for a camera that never found a word.
    """

    seen: csr_array
    has: NDArray[np.bool_]

    @property
    def recognised(self) -> csr_array:
        """``seen`` at the places that have the camera, without each word's first sighting.

        That sighting is why the word is in the vocabulary at all. Counted with the others it would have every new
        place show some words of this very drive, and words that were seen once go together without fail.
        """
        columns = csc_array(self.seen[np.flatnonzero(self.has)])
        columns.sort_indices()
        columns.data[columns.indptr[:-1][np.diff(columns.indptr) > 0]] = 0
        columns.eliminate_zeros()
        return csr_array(columns)


@dataclass(frozen=True, slots=True)
class ShownWords:
    """The words that a view shows, by camera it has, each (N,); and the time spent on keys and on their words [s]."""

    shown: Mapping[str, NDArray[np.bool_]]
    features: float
    matching: float


class WordMap:
    """The places of a reference drive as bags of SIFT words, one vocabulary a camera.

    The vocabulary is the bench's own (``refseq.features.SiftWords``): it grows with the reference drive, as for all our
    methods, and what is like no word of it is dropped.

    Raises ``MapError`` when no view has an image with a word.
    """

    def __init__(self, views: Sequence[View], settings: SiftSettings = WORDS) -> None:
        cameras = sorted({camera for view in views for camera in view.images})
        self._K = len(views)
        self._extractors = {camera: SiftWords(camera, settings) for camera in cameras}
        self.bags: Mapping[str, Bags] = {c: self._learn(e, views) for c, e in self._extractors.items()}
        if not any(extractor.size for extractor in self._extractors.values()):
            raise MapError(f"{self._K} views show no word; valid is a drive with images")
        self._last: tuple[View, ShownWords] | None = None

    def __len__(self) -> int:
        return self._K

    def observe(self, view: View) -> ShownWords:
        """The words of a view. The last view's answer is kept, for whoever else asks about the same view."""
        if self._last is None or self._last[0] is not view:
            self._last = view, self._observe(view)
        return self._last[1]

    def _observe(self, view: View) -> ShownWords:
        start = time.perf_counter()
        found: dict[str, Observed] = {c: e.observe(view) for c, e in self._extractors.items() if c in view.images}
        shown = {camera: np.zeros(self._extractors[camera].size, np.bool_) for camera in found}
        for camera, observed in found.items():
            shown[camera][observed.ids] = True
        matching = sum(observed.matching for observed in found.values())
        return ShownWords(shown, time.perf_counter() - start - matching, matching)

    def _learn(self, extractor: SiftWords, views: Sequence[View]) -> Bags:
        has = np.array([extractor.sensor in view.images for view in views])
        none = np.zeros(0, np.intp)
        ids = [extractor.learn(view) if there else none for view, there in zip(views, has, strict=True)]
        indices = np.concatenate([none, *ids])
        pointers = np.cumsum([0, *map(len, ids)])
        return Bags(csr_array((np.ones(len(indices)), indices, pointers), shape=(len(views), extractor.size)), has)
