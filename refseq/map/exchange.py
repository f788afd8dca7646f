"""Cameras that have changed places: one's pictures fit the words that the map knows of the other."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features import Extractor
from refseq.health.change import MOST, bounded, gaussian
from refseq.map.matcher import Matcher
from refseq.view import View

FEATURE = "sift"
"""Words of this feature are compared: dense ones are so common that they fit everywhere."""

OWN, OTHERS = (0.4, 0.25), (-0.4, 0.25)
"""Mean and deviation of the share of descriptors known as the camera's own less that known as the other's, summed over
both cameras, of cameras in their places and of exchanged ones."""

DESCRIPTORS, FEWEST = 24, 8
"""Descriptors of a picture that are compared, and how many it takes: finding a word is the dearest step of a view."""

FIRST = 4
"""So many views are looked at anyway: cameras may have been exchanged since the map was learnt."""

USUAL, MEMORY = 0.65, 0.1
"""A share of known descriptors below this part of the usual one is looked into; weight of a view in the usual one."""


class ExchangeWatch:
    """Pairs of cameras of a map. What is dear is done only where a view's words are fewer than usual."""

    def __init__(self, extractors: Sequence[Sequence[Extractor]]) -> None:
        words = [{e.sensor: e for e in own if e.key.startswith(f"{FEATURE}/")} for own in extractors]
        self._words = words
        self._pairs = list(combinations(sorted(words[0]), 2))
        self._usual = dict.fromkeys(self._pairs, 0.0)
        self._views = dict.fromkeys(self._pairs, 0)

    def ratios(self, view: View, matcher: Matcher, suspected: frozenset[str]) -> Mapping[str, float]:
        """Log-likelihood ratio of each camera being exchanged with another [nats], after a view was matched.

        Cameras that are ``suspected`` are looked into at any rate; they may have been left out of the matching.
        """
        found: dict[str, float] = {}
        for pair in self._pairs:
            if not set(pair) <= set(view.images):
                continue
            if set(pair) <= suspected or self._odd(pair, matcher):
                ratio = self._compare(pair, view, matcher.described)
            else:
                ratio = -MOST / 2
            for camera in pair:
                found[camera] = max(ratio, found.get(camera, -MOST))
        return found

    def _odd(self, pair: tuple[str, str], matcher: Matcher) -> bool:
        """True for one of the first views, and where fewer words than usual are known."""
        keys = [f"{FEATURE}/{camera}" for camera in pair]
        if any(key not in matcher.described or not len(matcher.described[key]) for key in keys):
            return False
        known = max(sum(len(seen[key]) / len(matcher.described[key]) for key in keys) for seen in matcher.seen)
        self._views[pair] += 1
        if self._views[pair] <= FIRST:
            self._usual[pair] = max(self._usual[pair], known)
            return True
        odd = known < USUAL * self._usual[pair]
        if not odd:
            self._usual[pair] += MEMORY * (known - self._usual[pair])
        return odd

    def _compare(self, pair: tuple[str, str], view: View, described: Mapping[str, Any]) -> float:
        """The ratio by a sample of both pictures' descriptors, in the sequence that knows most of them."""
        samples = {camera: self._sample(camera, view, described) for camera in pair}
        if min(map(len, samples.values())) < FEWEST:
            return 0.0
        best, most = 0.0, -1.0
        for words in self._words:
            shares = {(c, o): len(words[o].recognise(samples[c])) / len(samples[c]) for c in pair for o in pair}
            own = sum(shares[camera, camera] for camera in pair)
            others = sum(shares.values()) - own
            if own + others > most:
                best, most = gaussian(own - others, OTHERS, OWN), own + others
        return bounded(best)

    def _sample(self, camera: str, view: View, described: Mapping[str, Any]) -> NDArray[Any]:
        extractor = self._words[0][camera]
        all_: NDArray[Any] = described[extractor.key] if extractor.key in described else extractor.describe(view)
        return all_[np.unique(np.linspace(0, len(all_) - 1, min(len(all_), DESCRIPTORS)).astype(np.intp))]
