"""Extractors whose features are the words of a growing vocabulary of descriptors."""

from abc import abstractmethod
from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple
from weakref import ReferenceType, ref

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import BaseExtractor
from refseq.features.memory import described
from refseq.features.vocabulary import Vocabulary, words_among
from refseq.view import View


class WordExtractor(BaseExtractor):
    """A view is described by descriptors, (n, D); a feature is a word that one of them is an alias of."""

    vocabulary: Vocabulary

    @property
    def size(self) -> int:
        """Number of words."""
        return len(self.vocabulary)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Words of a reference view; unknown descriptors become words."""
        return np.unique(self.vocabulary.learn(self.describe(view)))

    def recognise(self, described: NDArray[Any]) -> NDArray[np.intp]:
        """Words among descriptors."""
        return self.vocabulary.match(described)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """The words, (size, D)."""
        return {"words": self.vocabulary.words}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """Words that another drive's are aliases of."""
        return self.vocabulary.find(state["words"])


class PictureKeys(NamedTuple):
    """Keys of one picture: ``points`` (n, 2), x and y [pixels], and ``descriptors`` (n, D)."""

    points: NDArray[np.float32]
    descriptors: NDArray[np.uint8]


def packed(keys: PictureKeys) -> NDArray[np.void]:
    """Keys as one array, (n,), a point and a descriptor each."""
    both = np.dtype([("point", np.float32, 2), ("descriptor", np.uint8, keys.descriptors.shape[1])])
    found = np.empty(len(keys.points), both)
    found["point"], found["descriptor"] = keys
    return found


def unpacked(found: NDArray[np.void]) -> PictureKeys:
    """The inverse, as views of the array."""
    return PictureKeys(found["point"], found["descriptor"])


class _Recognised(NamedTuple):
    """Descriptors, the word of each, −1: none, and how many words there were."""

    described: NDArray[np.uint8]
    size: int
    ids: NDArray[np.intp]


class KeyWords(WordExtractor):
    """Words of the keys of one camera's pictures. ``settings`` are all that the keys of a picture depend on."""

    key: str
    sensor: str
    settings: Hashable

    def __init__(self) -> None:
        self._found: dict[int, tuple[ReferenceType[NDArray[np.uint8]], PictureKeys]] = {}
        self._recognised: _Recognised | None = None

    @abstractmethod
    def find_keys(self, image: NDArray[np.uint8]) -> PictureKeys:
        """Find the strongest keys of a picture; a blank one has none."""

    def keys(self, image: NDArray[np.uint8]) -> PictureKeys:
        """The strongest keys of a picture, remembered for ``drawn`` as long as somebody holds the picture."""
        found, number = self.find_keys(image), id(image)
        self._found[number] = ref(image, lambda _: self._found.pop(number, None)), found
        return found

    def drawn(self, image: NDArray[np.uint8]) -> PictureKeys:
        """As ``keys``, for drawing: not found again in a picture that was looked at."""
        looked_at, found = self._found.get(id(image), (None, None))
        return found if found and looked_at and looked_at() is image else self.keys(image)

    def recognise(self, described: NDArray[np.uint8]) -> NDArray[np.intp]:
        """Words among descriptors; which is whose is remembered for ``count_known``."""
        ids = self.vocabulary.find(described)
        self._recognised = _Recognised(described, self.size, ids)
        return words_among(ids)

    def count_known(self, described: NDArray[np.uint8], sample: NDArray[np.intp]) -> int:
        """Number of words among those of the descriptors (n, D) whose indices are in ``sample``."""
        last = self._recognised
        if last is not None and last.described is described and last.size == self.size:
            return len(words_among(last.ids[sample]))
        return len(self.vocabulary.match(described[sample]))

    def describe(self, view: View) -> NDArray[np.uint8]:
        """Descriptors of a view, (n, D)."""
        return self._described(view, self.keys).descriptors

    def shown(self, view: View) -> PictureKeys:
        """Keys of a view that was described just now, in the order of its descriptors: not found again."""
        return self._described(view, self.drawn)

    def _described(self, view: View, find: Callable[[NDArray[np.uint8]], PictureKeys]) -> PictureKeys:
        """Keys of a view as they are remembered: points and descriptors are one description, found or kept together."""
        return unpacked(described(self.settings, view.images[self.sensor], lambda seen: packed(find(seen))))
