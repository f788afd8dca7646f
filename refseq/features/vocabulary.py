"""A vocabulary of descriptors that grows image by image (A.3, Algorithm 3)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

DESCRIPTOR_SIZE = 128


@dataclass(slots=True)
class Vocabulary:
    """Words are the descriptors that were unlike all before them; the others became aliases of a word.

    ``alias_distance`` is the Euclidean distance up to which a descriptor is the same as a word. Descriptors are taken
    one by one in their order, so adding an image later gives what building all at once gives. Algorithm 3's noise,
    an aid for its k-d tree, is not needed: duplicates are aliases at distance 0.
    """

    alias_distance: float
    words: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((0, DESCRIPTOR_SIZE), np.uint8))

    def __len__(self) -> int:
        return len(self.words)

    def learn(self, descriptors: NDArray[np.uint8]) -> NDArray[np.intp]:
        """Word of each descriptor, (n,); those unlike every word so far are added. ``descriptors`` is (n, 128)."""
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

    def match(self, descriptors: NDArray[np.uint8]) -> NDArray[np.intp]:
        """Sorted ids of the words that at least one of the descriptors (n, 128) is an alias of."""
        ids, distances = self._nearest(descriptors)
        return np.unique(ids[distances <= self.alias_distance**2])

    def _nearest(self, descriptors: NDArray[np.uint8]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
        """Nearest word of each descriptor and its squared distance, infinite while there are no words."""
        if not len(self.words):
            return np.zeros(len(descriptors), np.intp), np.full(len(descriptors), np.inf, np.float32)
        squared = _squared_distances(descriptors, self.words)
        ids = np.argmin(squared, axis=1)
        return ids, squared[np.arange(len(ids)), ids]


def _squared_distances(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Squared Euclidean distances, (len(a), len(b)).

    Exact: the products of bytes are whole numbers, and their sums over 128 stay below 2²⁴, float32's last exact one.
    """
    x, y = a.astype(np.float32), b.astype(np.float32)
    squares: NDArray[np.float32] = np.einsum("ij,ij->i", x, x)[:, None] + np.einsum("ij,ij->i", y, y)[None, :]
    return squares - 2.0 * (x @ y.T)
