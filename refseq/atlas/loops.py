"""Loops of one path: stretches on which it comes back to places of its own.

A sequence is localised in itself as in any other, but that no view may be where it, or a neighbour of it, was learnt:
what is found then are the places to which the path came back. It has to come by the same way round, as cameras and a
laser that looks ahead see another place on the way back.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.alignment import align
from refseq.atlas.overlap import Overlap, OverlapSettings, PairJudge, PairSearch, told_by
from refseq.atlas.similarity import Translation, translated
from refseq.map.matcher import Measurement
from refseq.map.sequence import ReferenceSequence

NEVER = -50.0
"""Log ratio of a place that a view must not be at [nats]: no more than the chain's own numbers can hold."""


@dataclass(frozen=True)
class OwnTranslation(Translation):
    """A sequence to be looked for in itself: no place is found at one nearer along the path than ``loop`` [m]."""

    loop: float

    def measurements(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Measurement]:
        """Each place as a view that is looked for elsewhere on the path, in its order."""
        along = self.to.along
        for at, measured in zip(along, super().measurements(sensors=sensors, seed=seed), strict=True):
            yield elsewhere(measured, np.abs(along - at) < self.loop)


def elsewhere(measured: Measurement, near: NDArray[np.bool_]) -> Measurement:
    """A measurement without the places that are ``near``, (K,): likelihoods of all others sum to 1, or are even."""
    likelihood = np.where(near, 0.0, measured.likelihood)
    total = float(likelihood.sum())
    even = ~near / max(int((~near).sum()), 1)
    log_ratio = None if measured.log_ratio is None else np.where(near, NEVER, measured.log_ratio)
    return replace(measured, likelihood=likelihood / total if total > 0 else even, log_ratio=log_ratio)


@dataclass(frozen=True)
class LoopSearch(PairSearch):
    """Search of a sequence, ``one`` and ``other`` at once, for places that it comes back to; its earlier view first."""

    @classmethod
    def of(cls, sequence: ReferenceSequence, settings: OverlapSettings) -> "LoopSearch":
        """The search of a sequence."""
        return cls(sequence, sequence, settings)

    @cached_property
    def _judge(self) -> PairJudge:
        own = translated(self.one, self.one)
        way = OwnTranslation(own.columns, own.distances, own.to, self.settings.loop)
        there = align(way)
        return PairJudge(self.one, self.one, there, there, told_by(way, way), self.settings)

    def overlaps(self) -> list[Overlap]:
        """All stretches that the path seems to come back to, those that are objected to among them."""
        return super().overlaps() if np.ptp(self.one.along) > self.settings.loop else []

    def _matched(self) -> NDArray[np.intp]:
        pairs = super()._matched()
        return pairs[pairs[:, 0] < pairs[:, 1]]
