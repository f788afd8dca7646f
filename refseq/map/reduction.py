"""A reference sequence without some of its places, and without the words that only they showed."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refseq.features import Extractor
from refseq.map.extractors import make_extractor
from refseq.map.sequence import ReferenceSequence


def reduced(sequence: ReferenceSequence, places: NDArray[np.intp]) -> ReferenceSequence:
    """The sequence with these ``places`` only, rising, at least one; their distances along the path stay as they were.

    Words that none of them showed are forgotten; bits of fixed tables stay.
    """
    matrix, extractors, rows, sizes = sequence.matrix, [], [], {}
    seen = np.zeros(matrix.N, np.bool_)
    seen[np.concatenate(matrix.columns_of(places))] = True
    for extractor in sequence.extractors:
        block = matrix.blocks[extractor.key]
        kept = np.flatnonzero(seen[block.start : block.stop]) if extractor.state() else np.arange(len(block))
        extractors.append(_with_words(extractor, kept, sequence))
        rows.append(block.start + kept)
        sizes[extractor.key] = len(kept)
    return replace(
        sequence,
        matrix=matrix.kept(np.concatenate(rows), places, sizes),
        extractors=tuple(extractors),
        along=sequence.along[places],
        poses=tuple(sequence.poses[place] for place in places),
        odometry=sequence.odometry[places] if len(sequence.odometry) else sequence.odometry,
    )


def _with_words(extractor: Extractor, kept: NDArray[np.intp], sequence: ReferenceSequence) -> Extractor:
    state = {name: array[kept] for name, array in extractor.state().items()}
    return make_extractor(extractor.key, sequence.profile, state) if state else extractor
