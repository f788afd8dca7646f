"""Range queries: sums and maxima over many ranges of an array at once, by a sparse table (ranges of 1, 2, 4, …)."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray


class RangeQuery:
    """Queries over the ranges ``start:stop`` (any shape, integers) of arrays of length K.

    A maximum is that of two overlapping ranges of a power of two, a sum is that of disjoint ones: no sum is a
    difference, so that small values beside large ones keep all their digits. Building a table costs O(K log W) for
    ranges of at most W elements, and reading it O(1) for a maximum, O(log W) for a sum.
    """

    def __init__(self, start: NDArray[np.intp], stop: NDArray[np.intp], K: int) -> None:
        self.start, self.stop, self._K = start, stop, K
        self._length = stop - start
        self._lengths = np.arange(max(1, int(self._length.max())) + 1)
        self._levels = int(self._lengths[-1]).bit_length()

    def maxima(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Maximum over each range, −∞ for an empty one."""
        table = self._table(np.maximum, values, -np.inf)
        left, right = self._overlapping
        return np.maximum(table.take(left), table.take(right))

    def sums(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum over each range, 0 for an empty one."""
        table = self._table(np.add, values, 0.0)
        total: NDArray[np.float64] = np.zeros(self.start.shape)
        for piece in self._disjoint:
            total += table.take(piece)
        return total

    def _table(self, combine: np.ufunc, values: NDArray[np.float64], nothing: float) -> NDArray[np.float64]:
        """At level · K + i what ``values[i : i + 2 ** level]`` combine to; a last level of ``nothing``."""
        table = np.empty((self._levels + 1) * self._K + 1)
        table[self._levels * self._K :] = nothing
        rows = table[:-1].reshape(self._levels + 1, self._K)
        rows[0] = values
        for level in range(1, self._levels):
            half, count = 1 << (level - 1), self._K - (1 << level) + 1
            below = rows[level - 1]
            combine(below[:count], below[half : half + count], out=rows[level, :count])
        return table

    @cached_property
    def _overlapping(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """For each range the two table entries that cover it."""
        level = np.frexp(self._lengths)[1] - 1  # ⌊log₂ length⌋
        level[0] = self._levels
        left = level.astype(np.intp) * self._K
        right = left + np.where(self._lengths > 0, self._lengths - (1 << level), 0)
        return self.start + left[self._length], self.start + right[self._length]

    @cached_property
    def _disjoint(self) -> list[NDArray[np.intp]]:
        """The table entries that make up each range, by the binary digits of its length."""
        nothing, pieces = self._levels * self._K, []
        for level in range(self._levels):
            width = 1 << level
            # The smaller pieces lie before it.
            offset = np.where(self._lengths & width, level * self._K + (self._lengths & (width - 1)), nothing)
            pieces.append(self.start + offset[self._length])
        return pieces
