"""Two maps beside each other: what one would make of the other's views (card M4; 4.4.1).

A map keeps no pictures. A place of it is the features that its view showed, and these are translated: each word of one
vocabulary to the word of the other that it is an alias of. So maps are compared without the drives that they come from.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Timings
from refseq.map.matcher import Features, Measurement, check_among, compare
from refseq.map.sequence import ReferenceSequence, check_comparable


def columns(sequence: ReferenceSequence) -> Iterator[Features]:
    """The features of each place, place after place."""
    return map(sequence.matrix.by_block, sequence.matrix.columns())


def renamed(column: Features, names: Features) -> Features:
    """A place's features by other numbers; those without one, −1, are left out."""
    found = {key: np.unique(names[key][ids]) for key, ids in column.items()}
    return {key: ids[ids >= 0] for key, ids in found.items()}


@dataclass(frozen=True)
class Translation:
    """The places of one map in the features of another, ``to``, to be looked for there as often as is asked.

    ``columns`` are the places, without features that ``to`` does not know, ``distances`` those from place to place [m].
    """

    columns: Sequence[Features]
    distances: NDArray[np.float64]
    to: ReferenceSequence

    def measurements(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Measurement]:
        """Each place as a view that is looked for in the other map, in its order; by all ``sensors`` or some."""
        wanted = self.to.sensors if sensors is None else frozenset(sensors)
        check_among(wanted, self.to.sensors)
        keys = {extractor.key for extractor in self.to.extractors if extractor.sensor in wanted}
        for number, (column, distance) in enumerate(zip(self.columns, self.distances, strict=True)):
            seen = {key: ids for key, ids in column.items() if key in keys}
            yield compare(self.to, seen, float(distance), (seed, number), Timings())


def translated(of: ReferenceSequence, to: ReferenceSequence) -> Translation:
    """A map in the features of another. Raises ``MapError`` for maps of other features or settings."""
    check_comparable(to, of)
    pairs = zip(to.extractors, of.extractors, strict=True)
    names = {mine.key: mine.translated(other.state(), other.size) for mine, other in pairs}
    distances = np.diff(of.along, prepend=of.along[0])
    return Translation([renamed(column, names) for column in columns(of)], distances, to)


def view_similarity(of: ReferenceSequence, to: ReferenceSequence, seed: int = 0) -> NDArray[np.float64]:
    """The view similarity matrix (K_of, K_to): row i is what ``to`` answers to view i of ``of`` under a uniform prior.

    Rows sum to 1. It is not symmetric: each map knows its own features only. Raises ``MapError`` for maps of other
    features or settings.
    """
    return np.array([measured.likelihood for measured in translated(of, to).measurements(seed=seed)])
