"""Two maps beside each other: what one would make of the other's views (card M4; 4.4.1).

A map keeps no pictures. A place of it is the features that its view showed, and these are translated: each word of one
vocabulary to the word of the other that it is an alias of. So maps are compared without the drives that they come from.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Observed
from refseq.localiser import Matcher, Sighting
from refseq.sequence import ReferenceSequence

Column = Mapping[str, NDArray[np.intp]]
"""The features of a place by extractor, each numbered from 0."""


def check_comparable(one: ReferenceSequence, other: ReferenceSequence) -> None:
    """Raise ``MapError`` where maps have other features or settings: their words then mean other things."""
    theirs, ours = (", ".join(extractor.key for extractor in map_.extractors) for map_ in (other, one))
    if theirs != ours:
        raise MapError(f"features are {theirs}; valid are those of the first map, {ours}")
    mine, its = one.profile.to_dict(), other.profile.to_dict()
    for part, settings in mine.items():
        if settings != its[part]:
            raise MapError(f"profile.{part} is {its[part]!r:.80}; valid is that of the first map, {settings!r:.80}")


def columns(sequence: ReferenceSequence) -> Iterator[Column]:
    """The features of each place, place after place."""
    blocks = sequence.matrix.blocks
    for column in sequence.matrix.columns():
        yield {key: column[(column >= b.start) & (column < b.stop)] - b.start for key, b in blocks.items()}


def renamed(column: Column, names: Column) -> Column:
    """A place's features by other numbers; those without one, −1, are left out."""
    found = {key: np.unique(names[key][ids]) for key, ids in column.items()}
    return {key: ids[ids >= 0] for key, ids in found.items()}


def translated(of: ReferenceSequence, to: ReferenceSequence) -> list[Column]:
    """Each place of a map in the features of another, those left out that the other does not know."""
    check_comparable(to, of)
    pairs = zip(to.extractors, of.extractors, strict=True)
    names = {mine.key: mine.translated(other.state(), other.size) for mine, other in pairs}
    return [renamed(column, names) for column in columns(of)]


def sightings(
    of: ReferenceSequence, to: ReferenceSequence, *, sensors: Sequence[str] | None = None, seed: int = 0
) -> Iterator[Sighting]:
    """Each place of a map as a view that is looked for in another, in its order; by all ``sensors`` or some."""
    matcher = Matcher(to, sensors=sensors, seed=seed)
    keys = {extractor.key for extractor in matcher.extractors}
    distances = np.diff(of.along, prepend=of.along[0])
    for column, distance in zip(translated(of, to), distances, strict=True):
        yield matcher.compare({key: Observed(ids, 0.0) for key, ids in column.items() if key in keys}, float(distance))


def view_similarity(of: ReferenceSequence, to: ReferenceSequence, seed: int = 0) -> NDArray[np.float64]:
    """The view similarity matrix (K_of, K_to): row i is what ``to`` answers to view i of ``of`` under a uniform prior.

    Rows sum to 1. It is not symmetric: each map knows its own features only. Raises ``MapError`` for maps of other
    features or settings.
    """
    return np.array([sighting.likelihood for sighting in sightings(of, to, seed=seed)])
