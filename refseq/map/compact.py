"""Compact sequences (6.4.5): neighbouring places that cannot be told apart show the same features from then on.

A place that was taken out would leave a gap that the chain's steps do not fit, for which the thesis sought models of
duration. Here the places stay, with their poses and distances, and only what they show is made one: states with tied
emissions, in the words of speech recognition. The odometer goes on counting the metres between them, so that the
answers stay as fine as they were. Words that none of them shows any more are forgotten; the keys of a map of ``best``,
nearly half of its bytes, stay.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.neighbours import Neighbours
from refseq.inference.matching.place_distance import PlaceDistances
from refseq.map.map import Map
from refseq.map.merge_record import MergeRecord
from refseq.map.reduction import without_unseen
from refseq.map.sequence import ReferenceSequence

ALIKE, WITHIN = 0.5, 2.0
"""Chosen on ``annex`` and ``offices``: of all pairs the chain lost 1 % of its right answers on one. More saves more."""


@dataclass(frozen=True, slots=True)
class Compacted:
    """A compact map, and for each of its sequences the ``runs`` of places that show the same."""

    map: Map
    runs: tuple[tuple[range, ...], ...]


def compact(map_: Map, alike: float = ALIKE, within: float = WITHIN) -> Compacted:
    """Make places of a map one that lie beside each other and cannot be told apart.

    Any two of them are at most ``alike`` apart by ``PlaceDistances``, from 0, only equal ones, to 1, those that differ
    as much as places far apart do; and at most ``within`` [m] along the path.
    """
    made = [_compact(sequence, alike, within) for sequence in map_.sequences]
    sequences, runs = zip(*made, strict=True)
    # Its members are not compacted: merged anew they would make another map.
    return Compacted(replace(map_, sequences=sequences, record=MergeRecord()), runs)


def _compact(sequence: ReferenceSequence, alike: float, within: float) -> tuple[ReferenceSequence, tuple[range, ...]]:
    distances = PlaceDistances(sequence.matrix, Neighbours.of(sequence.along))
    runs = alike_runs(distances, sequence.along, alike, within)
    shown = [features for run in runs for features in [common_features(distances, run)] * len(run)]
    return without_unseen(replace(sequence, matrix=_matrix_of(shown, sequence.matrix))), runs


def alike_runs(distances: PlaceDistances, along: NDArray[np.float64], alike: float, within: float) -> tuple[range, ...]:
    """The fewest runs of neighbouring places that are all at most ``alike`` and ``within`` [m] apart from each other.

    A part of such a run is one as well, so that to make each as long as can be, from the first place on, is best.
    """
    starts = [0]
    for place in range(1, len(along)):
        run = range(starts[-1], place)
        near = along[place] - along[run.start] <= within
        if not (near and all(distances.between(place, other) <= alike for other in reversed(run))):
            starts.append(place)
    return tuple(range(start, stop) for start, stop in zip(starts, [*starts[1:], len(along)], strict=True))


def common_features(distances: PlaceDistances, run: range) -> NDArray[np.intp]:
    """Features that stand for a run: those of its most central place, and all that two of its places show."""
    if len(run) == 1:
        return distances.columns[run.start]
    central = min(run, key=lambda place: sum(distances.nats(place, other) for other in run))
    ids, counts = np.unique(np.concatenate([distances.columns[place] for place in run]), return_counts=True)
    return np.union1d(distances.columns[central], ids[counts >= 2])


def _matrix_of(shown: Sequence[NDArray[np.intp]], matrix: IncidenceMatrix) -> IncidenceMatrix:
    """A matrix of the same features whose columns are ``shown``, by rows."""
    columns = list(map(matrix.by_block, shown))
    return IncidenceMatrix.from_columns(columns, {key: len(block) for key, block in matrix.blocks.items()})
