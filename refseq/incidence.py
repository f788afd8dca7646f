"""The feature incidence matrix (card V2): which feature was seen at which place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class IncidenceMatrix:
    """N binary features by K places, packed: for each feature the places where it was seen.

    ``pointers`` (N + 1,) and ``places`` (nnz,): feature ``i`` was seen at ``places[pointers[i]:pointers[i + 1]]``, in
    rising order. Most features are seen at a few neighbouring places only, so this is a hundredth of the byte matrix.
    ``blocks`` gives each extractor's rows.
    """

    pointers: NDArray[np.int64]
    places: NDArray[np.int32]
    K: int
    blocks: Mapping[str, range]

    @classmethod
    def from_columns(cls, columns: Sequence[Mapping[str, NDArray[np.intp]]], sizes: Mapping[str, int]) -> Self:
        """Pack the columns of K places, each a mapping from extractor to the ids of its active features.

        ``sizes`` is the number of features of each extractor; a place may lack an extractor whose sensor was missing.
        """
        blocks = _blocks(sizes)
        pairs = [
            (blocks[key].start + ids, np.full(len(ids), place))
            for place, column in enumerate(columns)
            for key, ids in column.items()
        ]
        rows = np.concatenate([row for row, _ in pairs]) if pairs else np.zeros(0, np.intp)
        places = np.concatenate([place for _, place in pairs]) if pairs else np.zeros(0, np.intp)
        order = np.argsort(rows, kind="stable")  # the columns come by rising place, so each row stays sorted
        n = sum(sizes.values())
        pointers = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))]).astype(np.int64)
        return cls(pointers, places[order].astype(np.int32), len(columns), blocks)

    @classmethod
    def from_rows(
        cls, pointers: NDArray[np.int64], places: NDArray[np.int32], K: int, sizes: Mapping[str, int]
    ) -> Self:
        """Take rows that were packed before. Raises ``ValueError`` when they are no incidence matrix."""
        n = sum(sizes.values())
        if (
            pointers.shape != (n + 1,)
            or pointers[0] != 0
            or pointers[-1] != len(places)
            or (np.diff(pointers) < 0).any()
        ):
            raise ValueError(f"pointers do not rise from 0 to {len(places)} in {n} steps")
        if (outside := places[(places < 0) | (places >= K)]).size:
            raise ValueError(f"a feature is at place {int(outside[0])}; valid are 0 to {K - 1}")
        return cls(pointers.astype(np.int64), places.astype(np.int32), K, _blocks(sizes))

    @property
    def N(self) -> int:
        """Number of features."""
        return len(self.pointers) - 1

    def rows(self, ids: NDArray[np.intp]) -> NDArray[np.bool_]:
        """The rows of some features, unpacked: (len(ids), K)."""
        dense = np.zeros((len(ids), self.K), np.bool_)
        counts = self.pointers[ids + 1] - self.pointers[ids]
        starts = np.repeat(self.pointers[ids] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
        dense[np.repeat(np.arange(len(ids)), counts), self.places[starts + np.arange(counts.sum())]] = True
        return dense

    def column(self, place: int) -> NDArray[np.intp]:
        """Ids of the features seen at a place, in rising order."""
        entries = np.flatnonzero(self.places == place)
        return np.searchsorted(self.pointers, entries, side="right") - 1

    def columns(self) -> list[NDArray[np.intp]]:
        """``column`` of every place, in one pass."""
        features = np.repeat(np.arange(self.N), np.diff(self.pointers))
        order = np.argsort(self.places, kind="stable")
        ends = np.cumsum(np.bincount(self.places, minlength=self.K))
        return np.split(features[order], ends[:-1])


def _blocks(sizes: Mapping[str, int]) -> dict[str, range]:
    """Rows of each extractor, one after the other."""
    stops = np.cumsum([0, *sizes.values()])
    return {key: range(int(start), int(start) + size) for (key, size), start in zip(sizes.items(), stops, strict=False)}
