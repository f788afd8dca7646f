"""The motion window as a count of places: one lies under a bar of Fig. 3.7 or it does not."""

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.range_query import Stretches


class CountedWindow:
    """P(k | j, d): probability of place k after ``distance`` [m] from place j, for all j and k.

    Equation (3.2) as printed weights by the distance itself and is not normalised; this is Fig. 3.7's window instead,
    normalised over k for every j. ``along`` (K,) is each place's distance along the path [m], rising; the high bar
    reaches ``wide`` [m] to both sides of d, the low ones |d| farther, at ``thin`` times its height. They reach back to
    where the robot was, so no row is empty. Negative distances work: the robot reversed.

    Places that lie farther apart than the bar is wide are counted in steps of whole places: views in shorter steps
    leave the robot where it was.

    The rows are never formed: the places that reach k are neighbours, so sums and maxima over them cost O(K log W) for
    windows of at most W places.
    """

    def __init__(self, along: NDArray[np.float64], distance: float, wide: float, thin: float) -> None:
        # Rows: the wide bar, and the thin bars, which lie under the wide one too.
        half_width = np.array([[wide], [wide + abs(distance)]])
        self._first = np.searchsorted(along, along + (distance - half_width), side="left")
        self._stop = np.searchsorted(along, along + (distance + half_width), side="right")
        self._thin, self._log_thin = thin, _log(thin)
        # The wide bar adds only what the thin ones lack, so that it is 1 high.
        self._mass = self._added_up(self._stop - self._first)
        self._log_mass = np.log(self._mass)

    def shift(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""
        return self._added_up(self._sources.sums(belief / self._mass))

    def pull(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_k P(k | j, d) value(k), (K,): the transpose of ``shift``."""
        return self._added_up(self._targets.sums(values)) / self._mass

    def best(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_j score(j) + log P(k | j, d), (K,); −∞ where nothing reaches k."""
        high, low = self._sources.maxima(score - self._log_mass)
        best: NDArray[np.float64] = np.maximum(high, low + self._log_thin)
        return best

    def into(self, k: int) -> tuple[slice, NDArray[np.float64]]:
        """The places that reach ``k``, and log P(k | j, d) for each of them."""
        (wide, thin), (wide_stop, thin_stop) = self._sources.start[:, k], self._sources.stop[:, k]
        log_height = np.full(thin_stop - thin, self._log_thin)
        log_height[wide - thin : wide_stop - thin] = 0.0
        return slice(thin, thin_stop), log_height - self._log_mass[thin:thin_stop]

    def surprise(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d) (−log P(k | j, d)), (K,)."""
        share = belief / self._mass
        by_mass = self._added_up(self._sources.sums(share * self._log_mass))
        if self._thin == 0:
            return by_mass
        wide, both = self._sources.sums(share)
        surprise: NDArray[np.float64] = by_mass - self._thin * self._log_thin * (both - wide)
        return surprise

    def _added_up(self, levels: NDArray[Any]) -> NDArray[np.float64]:
        """What both levels (2, K) add up to, (K,)."""
        total: NDArray[np.float64] = (1 - self._thin) * levels[0] + self._thin * levels[1]
        return total

    @cached_property
    def _targets(self) -> Stretches:
        """For each place and level the places that it reaches."""
        return Stretches(self._first, self._stop, self._first.shape[1])

    @cached_property
    def _sources(self) -> Stretches:
        """For each place and level the places that reach it: those whose targets have begun and not yet ended."""
        return Stretches(_how_many_up_to(self._stop), _how_many_up_to(self._first), self._first.shape[1])


def _how_many_up_to(edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """For each k below K the number of edges ≤ k, row by row, (2, K)."""
    K = edges.shape[1]
    counts: NDArray[np.intp] = np.stack([np.bincount(row, minlength=K + 1)[:K] for row in edges])
    return counts.cumsum(axis=1)


def _log(probability: float) -> float:
    return math.log(probability) if probability > 0 else -math.inf
