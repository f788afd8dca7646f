"""A reference sequence without some of its places or words, and without the words that no place shows any more."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refseq.features import Extractor
from refseq.inference.matching.information import feature_information, neighbour_noise
from refseq.inference.matching.neighbours import Neighbours
from refseq.map.extractors import make_extractor
from refseq.map.sequence import ReferenceSequence


def reduced(sequence: ReferenceSequence, places: NDArray[np.intp]) -> ReferenceSequence:
    """The sequence with these ``places`` only, rising, at least one; their distances along the path stay as they were.

    Words that none of them showed are forgotten; bits of fixed tables stay.
    """
    matrix, its = sequence.matrix, sequence.experiences
    sizes = {key: len(block) for key, block in matrix.blocks.items()}
    left = its.at(places) if its is not None else None
    return without_unseen(
        replace(
            sequence,
            matrix=matrix.kept(np.arange(matrix.N), places, sizes),
            along=sequence.along[places],
            poses=tuple(sequence.poses[place] for place in places),
            odometry=sequence.odometry[places] if len(sequence.odometry) else sequence.odometry,
            experiences=left if left is not None and len(left) else None,
        )
    )


def without_unseen(sequence: ReferenceSequence) -> ReferenceSequence:
    """The sequence without words that no place shows, nor ever showed on a later drive."""
    shown = np.diff(sequence.matrix.pointers) > 0
    if sequence.experiences is not None:
        shown |= np.diff(sequence.experiences.matrix.pointers) > 0
    return _with_features(sequence, shown)


def with_most_informative(sequence: ReferenceSequence, count: int) -> ReferenceSequence:
    """The sequence with the ``count`` words that tell most about the place (2.2.1, 2.6), of equal ones the first.

    A word's worth is its mutual information with the place (``feature_information``), given how often its extractor's
    features are seen again at the next place. Bits of fixed tables stay: they are few, and their number is the table's.
    """
    matrix = sequence.matrix
    told, neighbours = np.full(matrix.N, -1.0), Neighbours.of(sequence.along)
    for extractor in sequence.extractors:
        block = matrix.blocks[extractor.key]
        if extractor.state():
            noise = neighbour_noise(matrix, block, neighbours)
            told[block.start : block.stop] = feature_information(matrix, block, noise)
    chosen = np.zeros(matrix.N, np.bool_)
    chosen[np.argsort(-told, kind="stable")[:count]] = True
    return _with_features(sequence, chosen)


def share_of_words(sequence: ReferenceSequence, share: float) -> int:
    """Number of words that a share of all of them is, at least one."""
    return max(1, round(share * sum(extractor.size for extractor in sequence.extractors if extractor.state())))


def _with_features(sequence: ReferenceSequence, chosen: NDArray[np.bool_]) -> ReferenceSequence:
    """The sequence with the chosen words, by a mask (N,), and all bits of fixed tables."""
    matrix, extractors, rows, sizes = sequence.matrix, [], [], {}
    for extractor in sequence.extractors:
        block = matrix.blocks[extractor.key]
        kept = np.flatnonzero(chosen[block.start : block.stop]) if extractor.state() else np.arange(len(block))
        extractors.append(_with_words(extractor, kept, sequence))
        rows.append(block.start + kept)
        sizes[extractor.key] = len(kept)
    left, its = np.concatenate(rows), sequence.experiences
    return replace(
        sequence,
        matrix=matrix.kept(left, np.arange(matrix.K), sizes),
        extractors=tuple(extractors),
        experiences=its.with_rows(left, sizes) if its is not None else None,
    )


def _with_words(extractor: Extractor, kept: NDArray[np.intp], sequence: ReferenceSequence) -> Extractor:
    state = {name: array[kept] for name, array in extractor.state().items()}
    return make_extractor(extractor.key, sequence.profile, state) if state else extractor
