"""Rows of the incidence matrix, and their columns with equal ones merged.

A view shows a few hundred features, each seen at a few places: nearly all columns of those rows are empty and alike.
Merged columns that remember how many they stand for give a mixture the same answer at a fraction of the cost.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

LARGE = 2_000_000
SPARSE = 1 / 10
"""Multiplications from which sparse factors pay, and the share of ones up to which they do; by measurement."""
LONG = 50
"""Entries a row on average from which copying rows one by one is faster than looking up entries."""
Value = TypeVar("Value", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Rows:
    """n rows of an incidence matrix with K places: row ``i`` is true at ``places[pointers[i]:pointers[i + 1]]``.

    ``pointers`` is (n + 1,), ``places`` (nnz,), without repeats in a row.
    """

    pointers: NDArray[np.int64]
    places: NDArray[np.int32]
    K: int

    @classmethod
    def from_dense(cls, matrix: NDArray[np.bool_]) -> Self:
        """Pack rows (n, K)."""
        places = np.nonzero(matrix)[1]
        pointers = np.concatenate([[0], np.cumsum(matrix.sum(axis=1))])
        return cls(pointers.astype(np.int64), places.astype(np.int32), matrix.shape[1])

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.pointers) - 1

    def numbers(self) -> NDArray[np.intp]:
        """The row of each entry, (nnz,)."""
        return np.repeat(np.arange(self.n), np.diff(self.pointers))

    def select(self, ids: NDArray[np.intp]) -> "Rows":
        """Some of the rows, in the order of ``ids``."""
        counts = self.pointers[ids + 1] - self.pointers[ids]
        return Rows(np.concatenate([[0], np.cumsum(counts)]), selected(self.pointers, self.places, ids), self.K)

    def between(self, start: int, stop: int) -> "Rows":
        """The rows ``start`` to ``stop`` − 1, whose places are not copied."""
        low, high = self.pointers[start], self.pointers[stop]
        return Rows(self.pointers[start : stop + 1] - low, self.places[low:high], self.K)

    def pieces(self, most: int) -> Iterator["Rows"]:
        """The rows bunch by bunch, each of one row or of at most ``most`` entries: what bounds the memory of a pass."""
        start = 0
        while start < self.n:
            stop = int(np.searchsorted(self.pointers, self.pointers[start] + most, side="right")) - 1
            stop = min(max(stop, start + 1), self.n)
            yield self.between(start, stop)
            start = stop

    def dense(self) -> NDArray[np.bool_]:
        """The rows unpacked, (n, K)."""
        matrix = np.zeros((self.n, self.K), np.bool_)
        matrix[self.numbers(), self.places] = True
        return matrix


def selected(pointers: NDArray[np.int64], values: NDArray[Value], ids: NDArray[np.intp]) -> NDArray[Value]:
    """Values of some rows' entries, (nnz,), row after row in the order of ``ids``; ``values`` has one an entry."""
    starts, stops = pointers[ids], pointers[ids + 1]
    counts = stops - starts
    total = int(counts.sum())
    if total > LONG * len(ids):  # long rows are copied as they lie; of short ones the entries are looked up
        return np.concatenate([values[start:stop] for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)])
    shift = np.repeat(starts - (np.cumsum(counts) - counts), counts)
    return values[shift + np.arange(total)]


@dataclass(frozen=True, slots=True)
class Columns:
    """The D distinct columns of some rows.

    ``views`` (D, n) holds one a line, zeros and ones; the column of place k is ``views[group[k]]``, with
    ``group`` (K,); ``multiplicity`` (D,) is the number of places of each. Their order is that of their bits, first row
    first.
    """

    views: NDArray[np.float64]
    group: NDArray[np.intp]
    multiplicity: NDArray[np.float64]

    @property
    def K(self) -> int:
        """Number of places."""
        return len(self.group)

    def factor(self, width: int) -> NDArray[np.float64] | csr_matrix:
        """``views`` for products with matrices of ``width`` columns: sparse where that is less work than dense."""
        large = self.views.size * width > LARGE
        return (
            csr_matrix(self.views) if large and np.count_nonzero(self.views) < SPARSE * self.views.size else self.views
        )


def distinct_columns(rows: Rows) -> Columns:
    """Merge equal columns, in O(nnz + K) and a sort of the columns that are not empty."""
    touched = np.zeros(rows.K, np.bool_)
    touched[rows.places] = True
    # Line 0 stands for the empty column, line i for the i-th place that has a feature.
    line = np.where(touched, np.cumsum(touched), 0)
    words = _packed(rows, line[rows.places], int(touched.sum()) + 1)
    order = np.lexsort(words.T[::-1])
    ordered = words[order]
    new = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    rank = np.empty(len(words), np.intp)
    rank[order] = np.cumsum(new) - 1
    group = rank[line]
    multiplicity = np.bincount(group, minlength=int(new.sum())).astype(float)
    # The empty column comes first, and goes where no place has it.
    unused = int(multiplicity[0] == 0)
    return Columns(_unpacked(ordered[new][unused:], rows.n), group - unused, multiplicity[unused:])


def _packed(rows: Rows, lines: NDArray[np.intp], count: int) -> NDArray[np.uint64]:
    """Columns as numbers of 64 bits, (count, words): comparing lines of numbers compares columns, bit by bit."""
    bits = np.zeros((count, 64 * max(1, -(-rows.n // 64))), np.bool_)
    bits[lines, rows.numbers()] = True
    return np.packbits(bits, axis=1).view(">u8").astype(np.uint64)


def _unpacked(words: NDArray[np.uint64], n: int) -> NDArray[np.float64]:
    """The bits of packed columns, (D, n)."""
    octets = words.astype(">u8").view(np.uint8).reshape(len(words), 8 * words.shape[1])
    return np.unpackbits(octets, axis=1, count=n).astype(float)
