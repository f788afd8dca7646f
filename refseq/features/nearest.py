"""Exact nearest-neighbour search among descriptors, in blocks that fit the processor's cache."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

BLOCK = 1024
"""Words that are compared at once: few enough to stay in the processor's cache, many enough for a fast product."""


class Nearest(NamedTuple):
    """For each of n descriptors the id of a word, (n,), and the squared distance to it, (n,)."""

    ids: NDArray[np.intp]
    squared: NDArray[Any]


class WordBlock(NamedTuple):
    """Words made ready to be multiplied with: −2 times each, (D, W) float32, and their squared lengths, (W,)."""

    factors: NDArray[np.float32]
    squares: NDArray[np.float32]


def nearest(descriptors: NDArray[Any], words: NDArray[Any], ready: Sequence[WordBlock] | None = None) -> Nearest:
    """Nearest of the words (W, D), the first of equals, to each descriptor (n, D); at infinity while there are none.

    ``ready`` are the words' ``blocks``, for those that ask often about the same words: it is a fifth of the time for a
    whole picture, and most of it for a few descriptors.
    """
    rows = np.arange(len(descriptors))
    best = Nearest(np.zeros(len(rows), np.intp), np.full(len(rows), np.inf))
    room = None if ready is None else np.empty(len(rows) * BLOCK, np.float32)
    for number, start in enumerate(range(0, len(words), BLOCK)):
        if ready is None:
            squared = squared_distances(descriptors, words[start : start + BLOCK])
        else:
            squared = _products(descriptors, ready[number], room)
        ids = np.argmin(squared, axis=1)
        found = squared[rows, ids]
        closer = found < best.squared
        best.ids[closer] = start + ids[closer]
        best.squared[closer] = found[closer]
    return best


def blocks(words: NDArray[Any]) -> tuple[WordBlock, ...] | None:
    """The words (W, D) in blocks to multiply with; None for those that are compared pair by pair."""
    if not _multiplies(words):
        return None
    return tuple(_laid_row_by_row(_block(words[start : start + BLOCK])) for start in range(0, len(words), BLOCK))


def squared_distances(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Squared Euclidean distances, (len(a), len(b)), which do not depend on what else is in ``a`` and ``b``.

    A product of matrices rounds differently with its shape, which would make the vocabulary depend on how descriptors
    come in images. Bytes are safe from that: less 128, their sums over up to 256 stay below 2²⁴, float32's last exact
    whole number. Other numbers are compared pair by pair.
    """
    if not _multiplies(a):
        from scipy.spatial.distance import cdist  # takes long to import, and few descriptors are of such numbers

        pairs: NDArray[np.float64] = cdist(a, b, "sqeuclidean")
        return pairs
    return _products(a, _block(b))


def _multiplies(words: NDArray[Any]) -> bool:
    return words.dtype == np.uint8 and words.shape[1] <= 256


def _block(words: NDArray[Any]) -> WordBlock:
    y = _centred(words)
    return WordBlock(-2 * y.T, np.einsum("ij,ij->i", y, y))


def _laid_row_by_row(block: WordBlock) -> WordBlock:
    """Factors that were only turned make each product slower by a tenth; laying them out pays where many follow."""
    return block._replace(factors=np.ascontiguousarray(block.factors))


def _products(
    descriptors: NDArray[Any], block: WordBlock, room: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Squared distances, written into ``room`` where it is given: fresh memory for each block costs a tenth more."""
    x = _centred(descriptors)
    shape = len(x), len(block.squares)
    out = None if room is None else room[: shape[0] * shape[1]].reshape(shape)
    squared: NDArray[np.float32] = np.matmul(x, block.factors, out=out)
    squared += np.einsum("ij,ij->i", x, x)[:, None]
    squared += block.squares[None, :]
    return squared


def _centred(bytes_: NDArray[Any]) -> NDArray[np.float32]:
    """Whole numbers from −128 to 127, which have the same distances."""
    return bytes_.astype(np.float32) - np.float32(128)
