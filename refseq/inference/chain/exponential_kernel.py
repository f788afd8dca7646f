"""Exponential kernel over the places of a path: weighted sums and maxima in O(K), without its matrix."""

from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

REACH = 500.0
"""Largest exponent within a segment: exp(500) leaves room below the largest float, exp(−500) above the smallest."""


class ExponentialKernel:
    """The kernel n_ik = exp(−|s_k − s_i| / ``scale``) over places at s = ``along`` (K,) [m], rising.

    A sum over the places up to k is a running sum of x_i exp(s_i / scale), taken in segments short enough for the
    exponential: all of it costs O(K).
    """

    def __init__(self, along: NDArray[np.float64], scale: float) -> None:
        self.decay = (along - along[0]) / scale
        self._onward = _Segments(self.decay)
        self._step = np.exp(-np.diff(self.decay))

    @cached_property
    def _backward(self) -> "_Segments":
        return _Segments((self.decay[-1] - self.decay)[::-1])

    def before(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_{i ≤ k} x_i n_ik, (K,)."""
        return self._onward.running_sum(x)

    def after(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_{i ≥ k} x_i n_ik, (K,): the transpose of ``before``."""
        return self._backward.running_sum(x[::-1])[::-1]

    def around(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_i x_i n_ik, (K,)."""
        total = self.before(x)
        total[:-1] += self._step * self.after(x)[1:]
        return total

    def best_before(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_{i ≤ k} score_i + log n_ik, (K,)."""
        best: NDArray[np.float64] = np.maximum.accumulate(score + self.decay)
        best -= self.decay
        return best

    def best_after(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_{i ≥ k} score_i + log n_ik, (K,)."""
        best: NDArray[np.float64] = np.maximum.accumulate((score - self.decay)[::-1])[::-1] + self.decay
        return best

    def surprise_before(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_{i ≤ k} x_i n_ik (−log n_ik), (K,)."""
        surprise: NDArray[np.float64] = self.decay * self.before(x) - self.before(x * self.decay)
        return surprise

    def surprise_after(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_{i ≥ k} x_i n_ik (−log n_ik), (K,)."""
        surprise: NDArray[np.float64] = self.after(x * self.decay) - self.decay * self.after(x)
        return surprise


class _Segments:
    """Running sums discounted by exp(−(decay_k − decay_i)), ``decay`` (K,) rising from 0."""

    def __init__(self, decay: NDArray[np.float64]) -> None:
        segment = np.floor(decay / REACH)
        local = decay - segment * REACH
        self._up, self._down = np.exp(local), np.exp(-local)
        starts = np.flatnonzero(np.diff(segment)) + 1
        self._bounds = [0, *starts.tolist(), len(decay)]
        self._carried = np.exp(local[starts] - np.diff(decay)[starts - 1])
        """Factor from the last sum of a segment to the first of the next, on the next one's scale."""

    def running_sum(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        total = x * self._up
        for number, (start, stop) in enumerate(pairwise(self._bounds)):
            if number:
                total[start] += total[start - 1] * self._carried[number - 1]
            total[start:stop].cumsum(out=total[start:stop])
            total[start:stop] *= self._down[start:stop]
        return total
