"""Discrete motion model: a place lies under a bar of Fig. 3.7's window or it does not."""

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.range_query import RangeQuery

LEAST_TAIL = 1e-9
"""Height of the low bars where there are to be none, but no place lies under the high one."""


class DiscreteMotion:
    """P(k | j, d): probability of place k after ``distance`` [m] from place j, for all j and k.

    Equation (3.2) as printed weights by the distance itself and is not normalised; this is Fig. 3.7's window instead,
    normalised over k for every j. ``along`` (K,) is each place's distance along the path [m], rising; the high bar
    reaches ``half_width`` [m] to both sides of d, the low ones |d| farther, at ``tail`` times its height. They reach
    back to where the robot was, so no row is empty. Negative distances work: the robot reversed.

    Places that lie farther apart than the bar is broad are counted in steps of whole places: views in shorter steps
    leave the robot where it was. It is the low bars that do so, which are therefore never without any height there.

    The rows are never formed: the places that reach k are neighbours, so sums and maxima over them cost O(K log W) for
    windows of at most W places.
    """

    def __init__(self, along: NDArray[np.float64], distance: float, half_width: float, tail: float) -> None:
        # Rows: the high bar, and the low bars, which lie under the high one too.
        reach = np.array([[half_width], [half_width + abs(distance)]])
        self._first = np.searchsorted(along, along + (distance - reach), side="left")
        self._stop = np.searchsorted(along, along + (distance + reach), side="right")
        tail = tail or LEAST_TAIL * bool((self._stop[0] == self._first[0]).any())
        self._tail, self._log_tail = tail, log_of(tail)
        # The high bar adds only what the low ones lack, so that it is 1 high.
        self._mass = self._added_up(self._stop - self._first)
        self._log_mass = np.log(self._mass)

    def predict(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""
        return self._added_up(self._sources.sums(belief / self._mass))

    def backward(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_k P(k | j, d) value(k), (K,): the transpose of ``predict``."""
        return self._added_up(self._targets.sums(values)) / self._mass

    def best(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_j score(j) + log P(k | j, d), (K,); −∞ where nothing reaches k."""
        high, low = self._sources.maxima(score - self._log_mass)
        best: NDArray[np.float64] = np.maximum(high, low + self._log_tail)
        return best

    def predecessors(self, k: int) -> tuple[slice, NDArray[np.float64]]:
        """The places that reach ``k``, and log P(k | j, d) for each of them."""
        (high, low), (high_stop, low_stop) = self._sources.start[:, k], self._sources.stop[:, k]
        log_height = np.full(low_stop - low, self._log_tail)
        log_height[high - low : high_stop - low] = 0.0
        return slice(low, low_stop), log_height - self._log_mass[low:low_stop]

    def surprise(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d) (−log P(k | j, d)), (K,)."""
        share = belief / self._mass
        by_mass = self._added_up(self._sources.sums(share * self._log_mass))
        if self._tail == 0:
            return by_mass
        high, both = self._sources.sums(share)
        surprise: NDArray[np.float64] = by_mass - self._tail * self._log_tail * (both - high)
        return surprise

    def _added_up(self, levels: NDArray[Any]) -> NDArray[np.float64]:
        """Sum of both levels (2, K), by their heights, (K,)."""
        total: NDArray[np.float64] = (1 - self._tail) * levels[0] + self._tail * levels[1]
        return total

    @cached_property
    def _targets(self) -> RangeQuery:
        """The places that each place reaches, by level."""
        return RangeQuery(self._first, self._stop, self._first.shape[1])

    @cached_property
    def _sources(self) -> RangeQuery:
        """The places that reach each place, by level: those whose targets have begun and not yet ended."""
        return RangeQuery(_how_many_up_to(self._stop), _how_many_up_to(self._first), self._first.shape[1])


def _how_many_up_to(edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """For each k below K the number of edges ≤ k, row by row, (2, K)."""
    K = edges.shape[1]
    counts: NDArray[np.intp] = np.stack([np.bincount(row, minlength=K + 1)[:K] for row in edges])
    return counts.cumsum(axis=1)


def log_of(probability: float) -> float:
    """Logarithm of a probability, −∞ of 0."""
    return math.log(probability) if probability > 0 else -math.inf
