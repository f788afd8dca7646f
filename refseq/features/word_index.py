"""An approximate index of the words of a large vocabulary, made of nothing but the words."""

import faiss
import numpy as np
from numpy.typing import NDArray

from refseq.features.nearest import Nearest

_PROBES = 32
"""Cells that are searched for a descriptor."""


class WordIndex:
    """Each word is in the cell of its nearest anchor; a descriptor is compared with the words of the cells near it.

    The anchors are words themselves, evenly taken from the first 2ᵐ words, the largest power of two that there are.
    Clustering would find a little more for the same work, but with words as anchors nothing is trained and nothing is
    drawn; all distances are whole numbers that float32 holds exactly; and the index depends on the words alone, not on
    how they came or on how many threads there are. So it needs no place in a map.
    """

    def __init__(self) -> None:
        self._size = 0
        self._power = -1

    def update(self, words: NDArray[np.uint8]) -> None:
        """Take in all ``words`` (W, D) after those of the last call, which they must begin with; W ≥ 1."""
        power = len(words).bit_length() - 1
        if power != self._power:
            self._start(words[: 2**power])
            self._size, self._power = 0, power
        self._cells.add(words[self._size :].astype(np.float32))
        self._size = len(words)

    def nearest(self, descriptors: NDArray[np.uint8]) -> Nearest:
        """The nearest word found for each descriptor (n, D); of equals, any one."""
        squared, ids = self._cells.search(descriptors.astype(np.float32), 1)
        return Nearest(ids[:, 0].astype(np.intp), squared[:, 0])

    def _start(self, words: NDArray[np.uint8]) -> None:
        """Empty cells around anchors: 4 √W of them, so that finding cells and searching them cost alike."""
        step = max(1, round(len(words) ** 0.5 / 4))
        anchors = words[::step].astype(np.float32)
        # The cells refer to the anchors, which must live as long.
        self._anchors = faiss.IndexFlatL2(words.shape[1])
        self._anchors.add(anchors)
        self._cells = faiss.IndexIVFScalarQuantizer(
            self._anchors, words.shape[1], len(anchors), faiss.ScalarQuantizer.QT_8bit_direct, faiss.METRIC_L2, False
        )
        self._cells.is_trained = True  # bytes are kept as they are, and the anchors are given
        self._cells.nprobe = _PROBES
