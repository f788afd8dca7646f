"""The place that looks most alike, each view for itself."""

from typing import TYPE_CHECKING

import numpy as np

from refseq.belief import Belief
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import answer
from refseq_bench.scenarios.methods.baselines.likelihood import SimilarityLikelihood
from refseq_bench.scenarios.methods.baselines.vlad import VladMap, as_vlad

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference

CONTRAST = 20.0
"""Ratio of likelihoods between the most and the least alike place; it shapes the belief, not the answer."""


class SingleBest:
    """Image retrieval: the nearest vector.

    It has no notion of being off the map. Its doubt, which never goes as far as to say lost, is how unlike the best
    place looks: (1 − cosine) / 2, at most ½.
    """

    def __init__(self, places: VladMap) -> None:
        self._places = places
        self._likelihood = SimilarityLikelihood(CONTRAST)

    def reset(self) -> None:
        """Forget how far the distances spread so far."""
        self._likelihood.reset()

    def update(self, view: View) -> Belief:
        """Compare with all places."""
        likeness = self._places.compare(view)
        if likeness.values is None:
            return answer(np.ones(len(self._places)), 0.5, likeness)
        doubt = (1 - max(float(likeness.values.max()), 0.0)) / 2
        return answer(self._likelihood(likeness.values), doubt, likeness)


def learnt(reference: "Reference") -> SingleBest:
    """The method, once it has learnt a reference drive."""
    return SingleBest(reference.once(as_vlad))
