"""Cameras that have changed places: one's pictures fit the words that the map knows of the other."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features import Extractor
from refseq.features.word_extractor import KeyWords
from refseq.health.change import MOST, bounded, gaussian
from refseq.view import View

OWN, OTHERS = (0.25, 0.18), (-0.25, 0.18)
"""Mean and deviation of the share of a camera's descriptors known as its own less that known as the other's, of cameras
in their places and of exchanged ones."""

DESCRIPTORS, FEWEST = 24, 8
"""Descriptors of a picture that are compared, and how many it takes: finding a word is the dearest step of a view."""


class ExchangeWatch:
    """Pairs of cameras of a map, of which each view tells how well they fit their own words and each other's."""

    def __init__(self, extractors: Sequence[Sequence[Extractor]]) -> None:
        # Of a camera's first one; dense words are no keys', and so common that they fit everywhere.
        self._words = [{e.sensor: e for e in reversed(own) if isinstance(e, KeyWords)} for own in extractors]
        self._pairs = list(combinations(sorted(self._words[0]), 2))

    def ratios(self, view: View, described: Mapping[str, Any]) -> Mapping[str, float]:
        """Log-likelihood ratio of each camera being exchanged with another [nats].

        ``described`` is what was found in the view by extractor; cameras that were left out of it are looked at here.
        """
        found: dict[str, float] = {}
        for pair in self._pairs:
            if set(pair) <= set(view.images):
                ratio = self._compare(pair, view, described)
                for camera in pair:
                    found[camera] = max(ratio, found.get(camera, -MOST))
        return found

    def _compare(self, pair: tuple[str, str], view: View, described: Mapping[str, Any]) -> float:
        """The ratio by a sample of each picture's descriptors, in the sequence that knows most of them.

        Pictures speak for themselves: that of a bare wall has no descriptors, and leaves the word to the other.
        """
        seen = {camera: self._described(camera, view, described) for camera in pair}
        best, most = 0.0, -1.0
        for words in self._words:
            ratio = known = 0.0
            for camera, other in (pair, pair[::-1]):
                sample = _sample(len(seen[camera]))
                if len(sample) >= FEWEST:
                    counts = (words[name].count_known(seen[camera], sample) for name in (camera, other))
                    own, others = (count / len(sample) for count in counts)
                    ratio, known = ratio + gaussian(own - others, OTHERS, OWN), known + own + others
            if known > most:
                best, most = ratio, known
        return bounded(best)

    def _described(self, camera: str, view: View, described: Mapping[str, Any]) -> NDArray[np.uint8]:
        extractor = self._words[0][camera]
        found: NDArray[np.uint8] = described[extractor.key] if extractor.key in described else extractor.describe(view)
        return found


def _sample(count: int) -> NDArray[np.intp]:
    """Indices of the descriptors that are looked at, of so many: evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, DESCRIPTORS)).astype(np.intp))
