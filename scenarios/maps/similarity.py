"""Similarity of the views of two maps, both ways."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.similarity import view_similarity
from refseq.files import replacing
from refseq.map.map import Map


@dataclass(frozen=True)
class Similarity:
    """Two maps by their names, and both view similarity matrices: (K_one, K_other) and (K_other, K_one)."""

    one: str
    other: str
    there: NDArray[np.float64]
    back: NDArray[np.float64]


def similarity_of(one: Map, other: Map) -> Similarity:
    """Compare two maps of one path both ways. Raises ``MapError`` for maps of other features or settings."""
    there, back = view_similarity(one.sequence, other.sequence), view_similarity(other.sequence, one.sequence)
    return Similarity(one.names[0], other.names[0], there, back)


def write_arrays(path: Path, found: Similarity) -> None:
    """Both matrices as ``there`` and ``back`` in a ``.npz`` file."""
    with replacing(path) as file:
        np.savez_compressed(file, there=found.there, back=found.back)
