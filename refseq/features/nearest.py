"""Exact nearest-neighbour search among descriptors, in blocks that fit the processor's cache."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

BLOCK = 1024
"""Words that are compared at once: few enough to stay in the processor's cache, many enough for a fast product."""


class Nearest(NamedTuple):
    """For each of n descriptors the id of a word, (n,), and the squared distance to it, (n,)."""

    ids: NDArray[np.intp]
    squared: NDArray[Any]


def nearest(descriptors: NDArray[Any], words: NDArray[Any]) -> Nearest:
    """Nearest of the words (W, D), the first of equals, to each descriptor (n, D); at infinity while there are none."""
    rows = np.arange(len(descriptors))
    best = Nearest(np.zeros(len(rows), np.intp), np.full(len(rows), np.inf))
    for start in range(0, len(words), BLOCK):
        squared = squared_distances(descriptors, words[start : start + BLOCK])
        ids = np.argmin(squared, axis=1)
        found = squared[rows, ids]
        closer = found < best.squared
        best.ids[closer] = start + ids[closer]
        best.squared[closer] = found[closer]
    return best


def squared_distances(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Squared Euclidean distances, (len(a), len(b)), which do not depend on what else is in ``a`` and ``b``.

    A product of matrices rounds differently with its shape, which would make the vocabulary depend on how descriptors
    come in images. Bytes are safe from that: their sums over up to 129 stay below 2²⁴, float32's last exact whole
    number. Other numbers are compared pair by pair.
    """
    if a.dtype != np.uint8 or a.shape[1] > 129:
        pairs: NDArray[np.float64] = cdist(a, b, "sqeuclidean")
        return pairs
    x, y = a.astype(np.float32), b.astype(np.float32)
    squared: NDArray[np.float32] = x @ (-2 * y.T)
    squared += np.einsum("ij,ij->i", x, x)[:, None]
    squared += np.einsum("ij,ij->i", y, y)[None, :]
    return squared
