"""Loops of one path: stretches on which it comes back to places of its own.

A sequence is localised in itself as in any other, but that no view may be where it, or a neighbour of it, was learnt:
what is found then are the places to which the path came back. It has to come by the same way round, as cameras and a
laser that looks ahead see another place on the way back.

A path that goes round more than twice is as likely in each of its rounds. So what was found is looked at no more, as it
is known to be where the path was before, and the path is looked through again, until nothing new is found. Each look
costs as much as the first, so that whoever asks stops where nothing of the last one stands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.alignment import align
from refseq.atlas.overlap import LaidViews, Overlap, OverlapSettings, PairJudge, PairSearch, told_by
from refseq.atlas.similarity import Translation, translated
from refseq.map.matcher import Measurement
from refseq.map.sequence import ReferenceSequence

NEVER = -50.0
"""Log ratio of a place that a view must not be at [nats]: no more than the chain's own numbers can hold."""


@dataclass(frozen=True)
class OwnTranslation(Translation):
    """A sequence to be looked for in itself.

    No place is found at one nearer along the path than ``loop`` [m], nor at one of the ``copies`` (K,), which are known
    to be where the path was before.
    """

    loop: float
    copies: NDArray[np.bool_]

    def measurements(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Measurement]:
        """Each place as a view that is looked for elsewhere on the path, in its order."""
        along = self.to.along
        for at, measured in zip(along, super().measurements(sensors=sensors, seed=seed), strict=True):
            yield elsewhere(measured, self.copies | (np.abs(along - at) < self.loop))


def elsewhere(measured: Measurement, near: NDArray[np.bool_]) -> Measurement:
    """A measurement without the places that are ``near``, (K,): likelihoods of all others sum to 1, or are even."""
    likelihood = np.where(near, 0.0, measured.likelihood)
    total = float(likelihood.sum())
    even = ~near / max(int((~near).sum()), 1)
    log_ratio = None if measured.log_ratio is None else np.where(near, NEVER, measured.log_ratio)
    return replace(measured, likelihood=likelihood / total if total > 0 else even, log_ratio=log_ratio)


@dataclass(frozen=True)
class LoopSearch(PairSearch):
    """Search of a sequence, ``one`` and ``other`` at once, for places that it comes back to; its earlier view first.

    The places ``copies`` (K,) are left out.
    """

    copies: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    @classmethod
    def of(cls, sequence: ReferenceSequence, settings: OverlapSettings) -> "LoopSearch":
        """The search of a sequence."""
        return cls(sequence, sequence, settings, np.zeros(len(sequence), np.bool_))

    @cached_property
    def _judge(self) -> PairJudge:
        own = translated(self.one, self.one)
        way = OwnTranslation(own.columns, own.distances, own.to, self.settings.loop, self.copies)
        there = align(way)
        return PairJudge(self.one, self.one, there, there, told_by(way, way), self.settings)

    def looks(self) -> Iterator[list[Overlap]]:
        """All stretches that the path seems to come back to, look by look; of the first those that are objected to."""
        if np.ptp(self.one.along) <= self.settings.loop:
            return
        copies, found = self.copies.copy(), self.overlaps()
        yield found
        while later := [one.pairs[:, 1] for one in found if not one.objection]:
            for places in later:
                copies[places[0] : places[-1] + 1] = True
            found = [one for one in replace(self, copies=copies.copy()).overlaps() if not one.objection]
            yield found

    def _stretches(self) -> list[NDArray[np.intp]]:
        return [part for pairs in super()._stretches() for part in by_rounds(pairs)]

    def _matched(self) -> NDArray[np.intp]:
        pairs = super()._matched()
        return pairs[pairs[:, 0] < pairs[:, 1]]

    def _without(self, nats: NDArray[np.float64], runs: Sequence[NDArray[np.intp]]) -> NDArray[np.float64]:
        return earlier_first(super()._without(nats, runs))

    def _given(self, laid: LaidViews, its: LaidViews) -> NDArray[np.float64]:
        return earlier_first(super()._given(laid, its))


def earlier_first(nats: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evidence of pairs of places of one path (K, K), each pair once: the earlier place tells of the later one."""
    return np.where(np.triu(np.ones(nats.shape, np.bool_), 1), nats, -np.inf)


def by_rounds(pairs: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """A stretch of pairs (n, 2) cut where its earlier views come to where its later ones began: round by round."""
    while len(pairs):
        count = int(np.searchsorted(pairs[:, 0], pairs[0, 1]))
        yield pairs[:count]
        pairs = pairs[count:]
