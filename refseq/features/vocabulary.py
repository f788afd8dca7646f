"""A vocabulary of descriptors that grows image by image (A.3, Algorithm 3)."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.nearest import BLOCK, WordBlock, blocks, nearest, squared_distances

if TYPE_CHECKING:
    from refseq.features.word_index import WordIndex


class Vocabulary:
    """Words are the descriptors that were unlike all before them; the others became aliases of a word.

    ``alias_distance`` is the Euclidean distance up to which a descriptor is the same as a word. ``words`` is (W, D); an
    empty one, (0, D), begins a vocabulary of descriptors of that size and type. Descriptors are taken one by one in
    their order, so adding an image later gives what building all at once gives. Algorithm 3's noise, an aid for its k-d
    tree, is not needed: duplicates are aliases at distance 0.

    Learning is exact at any size. So is matching up to ``exact_up_to`` words; larger vocabularies of bytes are matched
    by a ``WordIndex``, which misses a few aliases in a thousand. It is made from the words when it is first needed.
    """

    def __init__(self, alias_distance: float, words: NDArray[Any], exact_up_to: float = np.inf) -> None:
        self.alias_distance = alias_distance
        self.exact_up_to = exact_up_to
        self._rows = words
        self._count = len(words)
        self._index: WordIndex | None = None
        self._ready: tuple[int, tuple[WordBlock, ...] | None] = 0, None

    def __len__(self) -> int:
        return self._count

    @property
    def words(self) -> NDArray[Any]:
        """The words so far, (W, D), not to be written to."""
        words = self._rows[: self._count]
        words.setflags(write=False)
        return words

    def learn(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """Word of each descriptor, (n,); those unlike every word so far are added. ``descriptors`` is (n, D)."""
        parts = [self._learn(descriptors[start : start + BLOCK]) for start in range(0, len(descriptors), BLOCK)]
        return np.concatenate([np.zeros(0, np.intp), *parts])

    def match(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """Sorted ids of the words that at least one of the descriptors (n, D) is an alias of."""
        return words_among(self.find(descriptors))

    def find(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """The word that each descriptor is an alias of, (n,); −1 for one that is unlike all."""
        exact = self._count <= self.exact_up_to or self._rows.dtype != np.uint8
        found = nearest(descriptors, self.words, self._blocks()) if exact else self._indexed().nearest(descriptors)
        return np.where(found.squared <= self.alias_distance**2, found.ids, -1)

    def _blocks(self) -> tuple[WordBlock, ...] | None:
        """All words so far, ready to be compared with; made anew only where words have come."""
        if self._ready[0] != self._count:
            self._ready = self._count, blocks(self.words)
        return self._ready[1]

    def _learn(self, descriptors: NDArray[Any]) -> NDArray[np.intp]:
        """As ``learn``, for so few descriptors that all may be compared with all."""
        limit = self.alias_distance**2
        ids, squared = nearest(descriptors, self.words)
        among = squared_distances(descriptors, descriptors)
        unknown = squared > limit
        fresh: list[np.intp] = []
        for index in np.flatnonzero(unknown):
            if unknown[index]:
                fresh.append(index)
                unknown[index + 1 :] &= among[index, index + 1 :] > limit
        if fresh:
            # A descriptor may be nearer to one of this image's words than to an older one, if that was there before it.
            later = np.where(np.arange(len(ids))[:, None] < fresh, np.inf, among[:, fresh])
            closest = np.argmin(later, axis=1)
            closer = later[np.arange(len(ids)), closest] < squared
            ids[closer] = self._count + closest[closer]
            self._append(descriptors[fresh])
        return ids

    def _append(self, words: NDArray[Any]) -> None:
        """Add words; the room for them doubles when it is full, so that growing costs as much as the words are."""
        total = self._count + len(words)
        if total > len(self._rows):
            room = np.empty((max(total, 2 * len(self._rows)), self._rows.shape[1]), self._rows.dtype)
            room[: self._count] = self.words
            self._rows = room
        self._rows[self._count : total] = words
        self._count = total

    def _indexed(self) -> "WordIndex":
        """The index of all words so far."""
        # Imported here: the library starts threads of its own, which small vocabularies need not pay for.
        from refseq.features.word_index import WordIndex

        if self._index is None:
            self._index = WordIndex()
        self._index.update(self.words)
        return self._index


def words_among(found: NDArray[np.intp]) -> NDArray[np.intp]:
    """Sorted ids of the words in what ``Vocabulary.find`` found, each once."""
    ids = np.unique(found)
    return ids[ids >= 0]
