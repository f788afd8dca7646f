"""The feature incidence matrix (card V2): which feature was seen at which place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from refseq.inference.matching.columns import Rows


def feature_of(key: str) -> str:
    """The feature of a key, ``feature/sensor``."""
    return key.partition("/")[0]


def sensor_of(key: str) -> str:
    """The sensor of an extractor by its key, ``feature/sensor``; a sensor's name may have slashes, as topics have."""
    return key.partition("/")[2]


@dataclass(frozen=True, slots=True, eq=False)
class IncidenceMatrix:
    """N binary features by K places, packed: for each feature the places where it was seen.

    ``pointers`` (N + 1,) and ``places`` (nnz,): feature ``i`` was seen at ``places[pointers[i]:pointers[i + 1]]``, in
    rising order. Most features are seen at a few neighbouring places only, so this is a hundredth of the byte matrix.
    ``blocks`` gives each extractor's rows.

    A matrix is never changed. Places are added by ``appended``, which copies the packed arrays once however many places
    come: a drive that is under way collects its columns in a list and appends them when the matrix is asked for.
    """

    pointers: NDArray[np.int64]
    places: NDArray[np.int32]
    K: int
    blocks: Mapping[str, range]

    @classmethod
    def from_columns(cls, columns: Sequence[Mapping[str, NDArray[np.intp]]], sizes: Mapping[str, int]) -> Self:
        """Pack the columns of K places, each a mapping from extractor to the ids of its active features.

        ``sizes`` is the number of features of each extractor; a place may lack an extractor whose sensor was missing.
        Raises ``ValueError`` for an id that its extractor does not have.
        """
        blocks = _blocks(sizes)
        seen = [[_rows(key, blocks[key], ids) for key, ids in column.items()] for column in columns]
        rows = np.concatenate([np.zeros(0, np.intp), *(ids for column in seen for ids in column)])
        ends = np.cumsum([0, *(sum(map(len, column)) for column in seen)])
        packed = _packed(rows, ends, (sum(sizes.values()), len(columns))).tocsr()
        return cls(packed.indptr.astype(np.int64), packed.indices.astype(np.int32), len(columns), blocks)

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
        if len(falls := np.setdiff1d(np.flatnonzero(np.diff(places) <= 0) + 1, pointers)):
            before, after = places[falls[0] - 1 : falls[0] + 1]
            raise ValueError(f"a feature is at place {after} behind {before}; valid are places that rise")
        return cls(pointers.astype(np.int64, copy=False), places.astype(np.int32, copy=False), K, _blocks(sizes))

    def appended(self, columns: Sequence[Mapping[str, NDArray[np.intp]]], sizes: Mapping[str, int]) -> Self:
        """The matrix with further places behind its own, of vocabularies that may have grown meanwhile.

        ``columns`` and ``sizes`` are those of ``from_columns``, and so is the result: the same as of all columns at
        once. An extractor may be new. Raises ``ValueError`` when one that was there is missing, has fewer features than
        before, or stands in another order.
        """
        self._check_grown(sizes)
        new = type(self).from_columns(columns, sizes)
        counts = np.zeros(new.N, np.int64)
        for key, block in self.blocks.items():
            start = new.blocks[key].start
            counts[start : start + len(block)] = self.sightings(block)
        pointers = np.concatenate([[0], np.cumsum(counts)])
        # New places are higher than old ones: each row's go behind its end, and the row stays sorted.
        places = np.insert(self.places, np.repeat(pointers[1:], np.diff(new.pointers)), new.places + self.K)
        return type(self)(pointers + new.pointers, places, self.K + new.K, new.blocks)

    def kept(self, rows: NDArray[np.intp], places: NDArray[np.intp], sizes: Mapping[str, int]) -> Self:
        """Some features and places only, both rising; ``sizes`` is how many features of each extractor are left."""
        chosen = self.visible(rows)
        number = np.full(self.K, -1, np.int32)
        number[places] = np.arange(len(places))
        there = number[chosen.places] >= 0
        pointers = np.concatenate([[0], np.cumsum(there)])[chosen.pointers]
        return type(self)(pointers.astype(np.int64), number[chosen.places[there]], len(places), _blocks(sizes))

    def _check_grown(self, sizes: Mapping[str, int]) -> None:
        if [key for key in sizes if key in self.blocks] != list(self.blocks):
            raise ValueError(f"extractors are {', '.join(sizes)}; valid are {', '.join(self.blocks)}, and new ones")
        for key, block in self.blocks.items():
            if sizes[key] < len(block):
                raise ValueError(f"{key} has {sizes[key]} features; valid are {len(block)} and more")

    @property
    def N(self) -> int:
        """Number of features."""
        return len(self.pointers) - 1

    @property
    def sensors(self) -> Mapping[str, tuple[range, ...]]:
        """Each sensor's rows: the blocks of the extractors ("feature/sensor") that use it."""
        by_sensor: dict[str, tuple[range, ...]] = {}
        for key, block in self.blocks.items():
            sensor = sensor_of(key)
            by_sensor[sensor] = (*by_sensor.get(sensor, ()), block)
        return by_sensor

    def sightings(self, block: range) -> NDArray[np.int64]:
        """At how many places each feature of a block was seen, (len(block),)."""
        return np.diff(self.pointers[block.start : block.stop + 1])

    def statistics(self, *blocks: range) -> "Statistics":
        """Figures about the rows of some blocks; without any, about all rows."""
        chosen = blocks or (range(self.N),)
        sightings = np.concatenate([self.sightings(block) for block in chosen])
        entries = [self.places[self.pointers[block.start] : self.pointers[block.stop]] for block in chosen]
        a_view = np.bincount(np.concatenate(entries), minlength=self.K)
        return Statistics(
            features=len(sightings),
            places=self.K,
            entries=int(sightings.sum()),
            everywhere=int((sightings == self.K).sum()) if self.K else 0,
            nowhere=int((sightings == 0).sum()),
            once=int((sightings == 1).sum()),
            fewest=int(a_view.min(initial=self.N)) if self.K else 0,
            median=float(np.median(a_view)) if self.K else 0.0,
            most=int(a_view.max(initial=0)),
            nbytes=len(sightings) * self.pointers.itemsize + int(sightings.sum()) * self.places.itemsize,
        )

    def visible(self, ids: NDArray[np.intp]) -> Rows:
        """The rows of some features, still packed, in the order of ``ids``."""
        return Rows(self.pointers, self.places, self.K).select(ids)

    def block(self, key: str) -> Rows:
        """The rows of one extractor, packed; its places are not copied."""
        block = self.blocks[key]
        return Rows(self.pointers, self.places, self.K).between(block.start, block.stop)

    def zeros_and_ones(self, block: range) -> sparse.csr_array:
        """The rows of a block for sums over them, (len(block), K)."""
        first, last = self.pointers[block.start], self.pointers[block.stop]
        pointers = self.pointers[block.start : block.stop + 1] - first
        return sparse.csr_array((np.ones(last - first), self.places[first:last], pointers), shape=(len(block), self.K))

    def rows(self, ids: NDArray[np.intp]) -> NDArray[np.bool_]:
        """The rows of some features, unpacked: (len(ids), K)."""
        return self.visible(ids).dense()

    def column(self, place: int) -> NDArray[np.intp]:
        """Ids of the features seen at a place, in rising order."""
        entries = np.flatnonzero(self.places == place)
        return np.searchsorted(self.pointers, entries, side="right") - 1

    def columns(self) -> list[NDArray[np.intp]]:
        """``column`` of every place, in one pass."""
        turned = _packed(self.places, self.pointers, (self.K, self.N)).tocsr()
        return np.split(turned.indices.astype(np.intp), turned.indptr[1:-1])

    def by_block(self, column: NDArray[np.intp]) -> dict[str, NDArray[np.intp]]:
        """The rising ids of a column by their extractors, each numbered from its block's start."""
        ends = np.searchsorted(column, [0, *(block.stop for block in self.blocks.values())])
        parts = zip(self.blocks.items(), pairwise(ends), strict=True)
        return {key: column[first:last] - block.start for (key, block), (first, last) in parts}

    def columns_of(self, places: NDArray[np.intp]) -> list[NDArray[np.intp]]:
        """``column`` of some places, in one pass and without the others'."""
        wanted = np.zeros(self.K, np.bool_)
        wanted[places] = True
        entries = np.flatnonzero(wanted[self.places])
        features = np.searchsorted(self.pointers, entries, side="right") - 1
        at = self.places[entries]
        order = np.argsort(at, kind="stable")
        starts, stops = (np.searchsorted(at[order], places, side=side) for side in ("left", "right"))
        return [features[order[start:stop]] for start, stop in zip(starts, stops, strict=True)]


@dataclass(frozen=True, slots=True)
class Statistics:
    """Figures about some rows of an incidence matrix.

    ``entries`` are its ones. Of the ``features``, those seen ``everywhere`` and ``nowhere`` are constant and tell
    nothing; those seen ``once`` know a single place. ``fewest``, ``median`` and ``most`` are features a view, and
    ``nbytes`` is what the rows take in memory [bytes].
    """

    features: int
    places: int
    entries: int
    everywhere: int
    nowhere: int
    once: int
    fewest: int
    median: float
    most: int
    nbytes: int

    @property
    def constant(self) -> int:
        """Features that are the same at all places."""
        return self.everywhere + self.nowhere

    @property
    def sparsity(self) -> float:
        """Share of zeros; 1 for a matrix without entries."""
        return 1 - self.entries / max(1, self.features * self.places)

    @property
    def bytes_a_place(self) -> float:
        """Memory over the number of places [bytes]."""
        return self.nbytes / max(1, self.places)


def _rows(key: str, block: range, ids: NDArray[np.intp]) -> NDArray[np.intp]:
    """The rows of an extractor's features."""
    if len(outside := ids[(ids < 0) | (ids >= len(block))]):
        raise ValueError(f"{key} has seen feature {int(outside[0])}; valid are 0 to {len(block) - 1}")
    return block.start + ids


def _packed(rows: NDArray[np.integer], ends: NDArray[np.integer], shape: tuple[int, int]) -> sparse.csc_array:
    """A sparse matrix of ones, column after column; scipy turns it to rows in linear time, which sorting would not."""
    return sparse.csc_array((np.ones(len(rows), np.int8), rows, ends), shape=shape)


def _blocks(sizes: Mapping[str, int]) -> dict[str, range]:
    """Rows of each extractor, one after the other."""
    stops = np.cumsum([0, *sizes.values()])
    return {key: range(int(start), int(start) + size) for (key, size), start in zip(sizes.items(), stops, strict=False)}
