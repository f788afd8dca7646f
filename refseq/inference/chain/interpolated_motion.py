"""Interpolated motion model: a density along the path, each point of which the two places around it share."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.special import xlogy

from refseq.inference.paths import PathBounds

NARROWEST = 0.001
"""A bar is at least so wide [m]: a robot that stands, where there is no slack, stays at its place."""


class InterpolatedMotion:
    """P(k | j, d): probability of place k after ``distance`` [m] from place j, for all j and k.

    The two bars of Fig. 3.7 as densities of where the robot is: a high one ``half_width`` [m] to both sides of d, and a
    low one, ``tail`` times as high, |d| farther. A point between two places counts as both of them, the nearer the more
    (linear interpolation): so the mean of every row is along[j] + d, however far apart the places lie. That blurs by
    up to half the usual gap to either side, which the bars give up. What lies past a path's ends counts as its end.

    ``along`` (K,) are distances along the path [m], rising; ``ends`` the last places of the paths it is made of. A
    window of W places costs O(K W).
    """

    def __init__(
        self, along: NDArray[np.float64], distance: float, half_width: float, tail: float, ends: tuple[int, ...] = (-1,)
    ) -> None:
        self._along, self._K = along, len(along)
        self._path = PathBounds.of(along, ends)
        blur = self._path.gap / 2
        half_width = max(half_width, NARROWEST)
        full = half_width + abs(distance)
        bars = [((1 - tail) * half_width, half_width), (tail * full, full)]
        parts = [
            self._shared_out(along + distance, max(reach - blur, NARROWEST), weight) for weight, reach in bars if weight
        ]
        rows, columns, shares = (np.concatenate(part) for part in zip(*parts, strict=True))
        held = shares > 0
        rows, columns, shares = rows[held], columns[held], shares[held]
        shares /= np.bincount(rows, shares)[rows]
        self._matrix = csr_array((shares, (rows, columns)), (self._K, self._K))

    def predict(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""
        return np.asarray(self._sources @ belief)

    def backward(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_k P(k | j, d) value(k), (K,): the transpose of ``predict``."""
        return np.asarray(self._matrix @ values)

    def best(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_j score(j) + log P(k | j, d), (K,); −∞ where nothing reaches k."""
        best = np.full(self._K, -np.inf)
        into = self._sources
        reached = np.flatnonzero(np.diff(into.indptr))
        if len(reached):
            best[reached] = np.maximum.reduceat(score[into.indices] + np.log(into.data), into.indptr[reached])
        return best

    def predecessors(self, k: int) -> tuple[slice, NDArray[np.float64]]:
        """Places among which are all that reach ``k``, and log P(k | j, d) for each of them."""
        entries = slice(*self._sources.indptr[k : k + 2])
        sources, shares = self._sources.indices[entries], self._sources.data[entries]
        if not len(sources):
            return slice(0, 0), np.empty(0)
        reach = slice(int(sources.min()), int(sources.max()) + 1)
        log_shares = np.full(reach.stop - reach.start, -np.inf)
        log_shares[sources - reach.start] = np.log(shares)
        return reach, log_shares

    def surprise(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d) (−log P(k | j, d)), (K,)."""
        into = self._sources
        return np.asarray(csr_array((-xlogy(into.data, into.data), into.indices, into.indptr), into.shape) @ belief)

    @cached_property
    def _sources(self) -> csr_array:
        """The model's transpose: for each place those that reach it."""
        return csr_array(self._matrix.T)

    def _shared_out(
        self, middle: NDArray[np.float64], reach: float, weight: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Shares of a bar ``reach`` [m] around ``middle`` (K,): from which place, to which place, how much; (n,) each.

        A whole bar gives ``weight``. Some places occur more than once. No share is a difference of larger ones, so that
        small ones keep their digits.
        """
        along, first, last = self._along, self._path.first, self._path.last
        low, high = middle - reach, middle + reach
        before = np.maximum(0.0, np.minimum(high, along[first]) - low)
        after = np.maximum(0.0, high - np.maximum(low, along[last]))
        source, gap = self._gaps_under(low, high)
        start, stop = along[gap], along[gap + 1]
        inside = np.maximum(0.0, np.minimum(high[source], stop) - np.maximum(low[source], start))
        towards = (np.maximum(low[source], start) + np.minimum(high[source], stop)) / 2 - start
        onward = inside * towards / np.where(stop > start, stop - start, 1.0)
        places = np.arange(self._K)
        rows = np.concatenate([places, places, source, source])
        columns = np.concatenate([first, last, gap, gap + 1])
        return rows, columns, weight / (2 * reach) * np.concatenate([before, after, inside - onward, onward])

    def _gaps_under(
        self, low: NDArray[np.float64], high: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The gaps between places of one path that stretches low to high (K,) touch: (stretch, first place) pairs."""
        begin = np.maximum(np.searchsorted(self._along, low, side="right") - 1, self._path.first)
        end = np.minimum(np.searchsorted(self._along, high, side="left"), self._path.last)
        count = np.maximum(end - begin, 0)
        stretch = np.repeat(np.arange(self._K), count)
        within = np.arange(len(stretch)) - np.repeat(np.cumsum(count) - count, count)
        return stretch, begin[stretch] + within
