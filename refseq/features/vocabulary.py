"""A vocabulary of descriptors that grows image by image (A.3, Algorithm 3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist


@dataclass(slots=True)
class Vocabulary:
    """Words are the descriptors that were unlike all before them; the others became aliases of a word.

    ``alias_distance`` is the Euclidean distance up to which a descriptor is the same as a word. ``words`` is (W, D); an
    empty one, (0, D), begins a vocabulary of descriptors of that size and type. Descriptors are taken one by one in
    their order, so adding an image later gives what building all at once gives. Algorithm 3's noise, an aid for its k-d
    tree, is not needed: duplicates are aliases at distance 0.
    """

    alias_distance: float
    words: NDArray[Any]

    def __len__(self) -> int:
        return len(self.words)

    def learn(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """Word of each descriptor, (n,); those unlike every word so far are added. ``descriptors`` is (n, D)."""
        known = len(self.words)
        ids, distances = self._nearest(descriptors)
        fresh: list[int] = []
        limit = self.alias_distance**2
        within = _squared_distances(descriptors, descriptors)
        for index in range(len(descriptors)):
            if fresh:
                among = within[index, fresh]
                nearest = int(np.argmin(among))
                if among[nearest] < distances[index]:
                    ids[index], distances[index] = known + nearest, among[nearest]
            if distances[index] > limit:
                ids[index] = known + len(fresh)
                fresh.append(index)
        self.words = np.concatenate([self.words, descriptors[fresh]])
        return ids

    def match(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """Sorted ids of the words that at least one of the descriptors (n, D) is an alias of."""
        ids, distances = self._nearest(descriptors)
        return np.unique(ids[distances <= self.alias_distance**2])

    def _nearest(self, descriptors: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[Any]]:
        """Nearest word of each descriptor and its squared distance, infinite while there are no words."""
        if not len(self.words):
            return np.zeros(len(descriptors), np.intp), np.full(len(descriptors), np.inf)
        squared = _squared_distances(descriptors, self.words)
        ids = np.argmin(squared, axis=1)
        return ids, squared[np.arange(len(ids)), ids]


def _squared_distances(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Squared Euclidean distances, (len(a), len(b)), which do not depend on what else is in ``a`` and ``b``.

    A product of matrices rounds differently with its shape, which would make the vocabulary depend on how descriptors
    come in images. Bytes are safe from that: their sums over up to 129 stay below 2²⁴, float32's last exact whole
    number. Other numbers are compared pair by pair.
    """
    if a.dtype != np.uint8 or a.shape[1] > 129:
        pairs: NDArray[np.float64] = cdist(a, b, "sqeuclidean")
        return pairs
    x, y = a.astype(np.float32), b.astype(np.float32)
    squares: NDArray[np.float32] = np.einsum("ij,ij->i", x, x)[:, None] + np.einsum("ij,ij->i", y, y)[None, :]
    return squares - 2.0 * (x @ y.T)
