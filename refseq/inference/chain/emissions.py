"""Emission probabilities of the chain's states (card H3): similarity of the reference views, and the Lost View."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.special import expit

from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.lost_view import NO_SYMBOL, HeldOutViews, LostView, LostViewSymbol, is_above


@dataclass(frozen=True, slots=True)
class Seen:
    """A view as the emissions take it: distributions over the K places, (K,) and of sum 1.

    ``observed`` is the one that the chain observes, ``likelihood`` the view's alone. ``log_average`` is the log-odds of
    the Lost View, as the average features, against all places together.
    """

    observed: NDArray[np.float64]
    likelihood: NDArray[np.float64]
    log_average: float = -np.inf


MOST_ALIKE = 256
"""Most places that a row of the similarity keeps: enough to be exact for paths as long as the thesis'."""


@dataclass(frozen=True, slots=True)
class Emissions:
    """P(observed symbol | place), the similarity of the reference views among themselves, made non-zero.

    The symbols are the K views and the Lost View. Row i of the similarity is the mixture's posterior of reference view
    i: few places stand out from a level ``floor`` (K,) that the others have, so ``above`` (K, K) holds sparsely by
    how much they do. Rows sum to 1. ``symbol`` is the Lost View where it is learnt.
    """

    above: Any
    floor: NDArray[np.float64]
    settings: ChainSettings
    symbol: LostViewSymbol = NO_SYMBOL

    @classmethod
    def from_posteriors(
        cls, rows: Iterable[NDArray[np.float64]], settings: ChainSettings, held_out: HeldOutViews | None = None
    ) -> Self:
        """Take the K posteriors (K,) one by one, so that no matrix of K² numbers is needed.

        With ``held_out`` they also go there, to learn the Lost View from.
        """
        kept = []
        for place, row in enumerate(rows):
            kept.append(_peaks(row))
            if held_out is not None:
                held_out.add(place, row)
        K = len(kept)
        floor = np.array([level for _, _, level in kept])
        pointers = np.cumsum([0, *(len(places) for places, _, _ in kept)])
        places = np.concatenate([places for places, _, _ in kept])
        heights = np.concatenate([heights for _, heights, _ in kept])
        symbol = NO_SYMBOL if held_out is None else held_out.symbol()
        return cls(csr_array((heights, places, pointers), shape=(K, K)), floor, settings, symbol)

    @property
    def similarity(self) -> NDArray[np.float64]:
        """The similarity as a dense matrix (K, K), to look at."""
        dense: NDArray[np.float64] = self.above.toarray() + self.floor[:, None]
        return dense

    def log_likelihood(self, seen: Seen) -> tuple[NDArray[np.float64], float]:
        """Of a view: the log-likelihood of each place (K,), and of any Lost_Place.

        The distribution that is observed is soft evidence on which of the views is seen, so a place's likelihood is the
        mean of its row under it; the thesis' hard symbol is the case of a distribution that is sure. So is the Lost
        View by its average features: the likelihoods are means of it and the others.
        """
        K, s, places = len(seen.observed), self.settings, self._of_places(seen.observed)
        match s.lost_view:
            case LostView.NONE:
                return np.log(places), -float(np.log(K))
            case LostView.LEARNT:
                at_place, at_lost = self.symbol.log_likelihoods(seen.likelihood)
                return np.log(places) + at_place, at_lost - float(np.log(K))
            case LostView.ENTROPY:
                share = float(is_above(s.lost_view_entropy, seen.observed))
            case LostView.AVERAGE:
                share = float(expit(seen.log_average))
        places = (1 - share) * (1 - s.lost_view_at_place) * places + share * s.lost_view_at_place
        lost = (1 - share) * (1 - s.lost_view_at_lost) / K + share * s.lost_view_at_lost
        return np.log(places), float(np.log(lost))

    def log_likelihood_of_place(self, observed: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """The same of a distribution (K,) that is not the Lost View: one that says nothing is no sign of being lost."""
        match self.settings.lost_view:
            case LostView.NONE:
                at_place, at_lost = 0.0, 0.0
            case LostView.LEARNT:
                at_place, at_lost = self.symbol.at_place, self.symbol.at_lost
            case LostView.ENTROPY | LostView.AVERAGE:
                at_place, at_lost = self.settings.lost_view_at_place, self.settings.lost_view_at_lost
        return np.log((1 - at_place) * self._of_places(observed)), math.log((1 - at_lost) / len(observed))

    def _of_places(self, observed: NDArray[np.float64]) -> NDArray[np.float64]:
        """Likelihood of each place (K,), of a view that is one of the sequence's."""
        alike: NDArray[np.float64] = self.above @ observed + self.floor * observed.sum()
        return (1 - self.settings.noise) * alike + self.settings.noise / len(observed)


def _peaks(row: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64], float]:
    """The places that stand out from a posterior's floor, by how much, and the floor.

    The floor is the lowest value, which most places share where features are sparse, and what stands above it is kept
    exactly. Where that is more than ``MOST_ALIKE`` places, only those above the uniform 1 / K are kept, the highest
    first, and the floor is the mean of the others, so that the row still sums to 1.
    """
    K, floor = len(row), float(row.min())
    places = np.flatnonzero(row > floor)
    if len(places) > MOST_ALIKE:
        places = np.flatnonzero(row > 1 / K)
        if len(places) > MOST_ALIKE:
            places = np.sort(places[np.argpartition(-row[places], MOST_ALIKE)[:MOST_ALIKE]])
        floor = float(np.delete(row, places).mean())
    return places.astype(np.int32), row[places] - floor, floor
