"""Extractors whose features are the words of a growing vocabulary of descriptors."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import BaseExtractor
from refseq.features.vocabulary import Vocabulary
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
