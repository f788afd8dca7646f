"""Two maps beside each other: what one would make of the other's views (card M4; 4.4.1).

A map keeps no pictures. A place of it is the features that its view showed, and these are translated: each word of one
vocabulary to the word of the other that it is an alias of. So maps are compared without the drives that they come from.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Observed
from refseq.map.localiser import Matcher, Sighting
from refseq.map.sequence import ReferenceSequence

Column = Mapping[str, NDArray[np.intp]]
"""The features of a place by extractor, each numbered from 0."""


def check_comparable(one: ReferenceSequence, other: ReferenceSequence) -> None:
    """Raise ``MapError`` where maps have other features or settings: their words then mean other things."""
    theirs, ours = (", ".join(extractor.key for extractor in map_.extractors) for map_ in (other, one))
    if theirs != ours:
        raise MapError(f"features are {theirs}; valid are those of the first map, {ours}")
    its = dict(_leaves("profile", other.profile.to_dict()))
    for name, value in _leaves("profile", one.profile.to_dict()):
        if value != its[name]:
            raise MapError(f"{name} is {its[name]}; valid is that of the first map, {value}")


def _leaves(name: str, content: object) -> Iterator[tuple[str, object]]:
    """The settings of a profile by their whole names."""
    if not isinstance(content, Mapping):
        yield name, content
        return
    for key, value in content.items():
        yield from _leaves(f"{name}.{key}", value)


def columns(sequence: ReferenceSequence) -> Iterator[Column]:
    """The features of each place, place after place."""
    blocks = sequence.matrix.blocks
    for column in sequence.matrix.columns():
        yield {key: column[(column >= b.start) & (column < b.stop)] - b.start for key, b in blocks.items()}


def renamed(column: Column, names: Column) -> Column:
    """A place's features by other numbers; those without one, −1, are left out."""
    found = {key: np.unique(names[key][ids]) for key, ids in column.items()}
    return {key: ids[ids >= 0] for key, ids in found.items()}


@dataclass(frozen=True)
class Translation:
    """The places of one map in the features of another, ``to``, to be looked for there as often as is asked.

    ``columns`` are the places, without features that ``to`` does not know, ``distances`` those from place to place [m].
    """

    columns: Sequence[Column]
    distances: NDArray[np.float64]
    to: ReferenceSequence

    def sightings(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Sighting]:
        """Each place as a view that is looked for in the other map, in its order; by all ``sensors`` or some."""
        matcher = Matcher(self.to, sensors=sensors, seed=seed)
        keys = {extractor.key for extractor in matcher.extractors}
        for column, distance in zip(self.columns, self.distances, strict=True):
            observed = {key: Observed(ids, 0.0) for key, ids in column.items() if key in keys}
            yield matcher.compare(observed, float(distance))


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
    return np.array([sighting.likelihood for sighting in translated(of, to).sightings(seed=seed)])
