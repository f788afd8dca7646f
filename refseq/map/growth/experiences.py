"""Experiences: what places showed on later drives, in other light, beside what they showed when they were learnt.

The name is that of W. Churchill and P. Newman, "Experience-based navigation for long-term localisation", International
Journal of Robotics Research 32, 2013, where a place is likewise stored again only where it was not found.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.log_ratio import LogRatioModel, LogRatios, LogRatioSettings

FIRST = -1
"""Stands for what a place showed when it was learnt, where an experience is named by its number."""


@dataclass(frozen=True, eq=False)
class Experiences:
    """Further experiences of a sequence's places, E of them, in the order in which they came.

    ``matrix`` (N, E) holds what each showed, in the features of the sequence. Experience e is of place ``places[e]``,
    and was the one that knew its place best on ``uses[e]`` later drives.
    """

    matrix: IncidenceMatrix
    places: NDArray[np.intp]
    uses: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.places)

    @property
    def ranks(self) -> NDArray[np.intp]:
        """Number of experiences of the same place that came before each, (E,)."""
        order = np.argsort(self.places, kind="stable")
        ranks = np.empty(len(self), np.intp)
        ranks[order] = np.arange(len(self)) - np.searchsorted(self.places[order], self.places[order])
        return ranks

    def chosen(self, numbers: NDArray[np.intp]) -> Self:
        """Some of them, by rising numbers."""
        matrix = self.matrix
        sizes = {key: len(block) for key, block in matrix.blocks.items()}
        left = matrix.kept(np.arange(matrix.N), numbers, sizes)
        return replace(self, matrix=left, places=self.places[numbers], uses=self.uses[numbers])

    def at(self, places: NDArray[np.intp]) -> Self:
        """Those of some ``places``, rising, which take the numbers from 0 on."""
        left = self.chosen(np.flatnonzero(np.isin(self.places, places)))
        return replace(left, places=np.searchsorted(places, left.places))

    def with_rows(self, rows: NDArray[np.intp], sizes: Mapping[str, int]) -> Self:
        """The same with some of the features only, rising; ``sizes`` is how many of each extractor are left."""
        return replace(self, matrix=self.matrix.kept(rows, np.arange(len(self)), sizes))


class LayeredRatios:
    """Log-likelihood ratios of places that may have several experiences.

    In layer n every place shows its n-th further experience, and those that have none what they showed first; so a
    layer is a drive like any other, and is calibrated like one. A place's ratio is the mean over all its experiences:
    ratios that each average 1 or less where the place is not the one do so in the mean as well, which they would not
    in the largest.
    """

    def __init__(
        self,
        first: LogRatioModel,
        matrix: IncidenceMatrix,
        along: NDArray[np.float64],
        settings: LogRatioSettings,
        experiences: Experiences,
    ) -> None:
        self._models, self._asks_blocks = [first], settings.usual > 0
        self._numbers = [np.full(matrix.K, FIRST)]
        for rank in range(1 + max(experiences.ranks, default=-1)):
            numbers = np.full(matrix.K, FIRST)
            layer = np.flatnonzero(experiences.ranks == rank)
            numbers[experiences.places[layer]] = layer
            self._models.append(LogRatioModel(showing(matrix, experiences, layer), along, settings))
            self._numbers.append(numbers)
        self._own = np.array([np.ones(matrix.K, np.bool_), *(numbers != FIRST for numbers in self._numbers[1:])])

    def ratios(self, observed: Mapping[str, NDArray[np.intp]]) -> LogRatios:
        """Log-likelihood ratios of each place to elsewhere; ``observed`` has the ids seen by block."""
        layers = [model.ratios(observed) for model in self._models]
        asked = layers[0].by_block if self._asks_blocks else {}
        by_block = {
            key: self._mean([layer.by_block.get(key, ratios) for layer in layers]) for key, ratios in asked.items()
        }
        return LogRatios(self._mean([layer.log_ratios for layer in layers]), by_block, layers[0].power)

    def best(self, observed: Mapping[str, NDArray[np.intp]], place: int) -> int:
        """Number of the experience of a place that knows a view best, ``FIRST`` for what was learnt first."""
        ratios = self._of_its_own([model.log_ratios(observed) for model in self._models])
        return int(self._numbers[int(np.argmax(ratios[:, place]))][place])

    def _mean(self, layers: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Logarithm of the mean over each place's experiences, (K,), of log ratios in every layer."""
        mean: NDArray[np.float64] = logsumexp(self._of_its_own(layers), axis=0) - np.log(self._own.sum(axis=0))
        return mean

    def _of_its_own(self, layers: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Ratios in each layer, (1 + layers, K), −inf where a place has no experience of its own there."""
        return np.where(self._own, np.array(layers), -np.inf)


def showing(matrix: IncidenceMatrix, experiences: Experiences, numbers: NDArray[np.intp]) -> IncidenceMatrix:
    """The matrix of a sequence whose places show some of their experiences, one a place, in place of what they did."""
    place = np.full(len(experiences), -1)
    place[numbers] = experiences.places[numbers]
    rows, columns = _entries(matrix)
    stays = ~np.isin(columns, place[numbers])
    its_rows, its = _entries(experiences.matrix)
    comes = place[its] >= 0
    rows = np.concatenate([rows[stays], its_rows[comes]])
    columns = np.concatenate([columns[stays], place[its[comes]]])
    order = np.lexsort((columns, rows))
    pointers = np.searchsorted(rows[order], np.arange(matrix.N + 1))
    sizes = {key: len(block) for key, block in matrix.blocks.items()}
    return IncidenceMatrix.from_rows(pointers.astype(np.int64), columns[order].astype(np.int32), matrix.K, sizes)


def _entries(matrix: IncidenceMatrix) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Row and column of each entry."""
    return np.repeat(np.arange(matrix.N), np.diff(matrix.pointers)), matrix.places.astype(np.intp)
