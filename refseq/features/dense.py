"""Words of a grid of patches: what an image looks like where SIFT finds no keys (a feature of ours).

A blank wall has few corners but still edges, shades and a skirting board. Every cell of a coarse grid is described by
the orientations of its gradients (a SIFT descriptor at a fixed place, on a reduced image), and each description is
turned into words by winner-take-all codes (J. Yagnik et al., "The power of comparative reasoning", ICCV 2011): which of
a few entries, drawn once, is the largest. Only the order of the entries counts, so that a change of light that keeps it
keeps the word.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import Observed
from refseq.features.sift import DESCRIPTOR_SIZE
from refseq.view import View


@dataclass(frozen=True, slots=True)
class DenseSettings:
    """``columns`` × ``rows`` patches of ``patch`` pixels' key size on an image reduced to ``width`` pixels.

    Each patch gives ``codes`` words; a word is ``parts`` winners, each among ``among`` entries of the descriptor, drawn
    with ``seed``. A SIFT descriptor of key size s looks at about 6 s pixels to all sides together.
    """

    width: int = 160
    columns: int = 10
    rows: int = 7
    patch: float = 10.0
    codes: int = 16
    among: int = 8
    parts: int = 2
    seed: int = 2011


class DenseWords:
    """Words of one camera's image, ``columns`` · ``rows`` · ``codes`` of them in every view."""

    def __init__(self, camera: str, settings: DenseSettings, words: NDArray[np.int64] | None = None) -> None:
        self.key = f"dense/{camera}"
        self.sensor = camera
        self.settings = settings
        self._sift = cv2.SIFT.create()
        self._words = np.zeros(0, np.int64)
        self._id_of = np.full(self._all_words, -1, np.int64)
        if words is not None:
            self._add(np.asarray(words, np.int64))

    @property
    def _all_words(self) -> int:
        s = self.settings
        return int(s.columns * s.rows * s.codes * s.among**s.parts)

    @property
    def size(self) -> int:
        """Number of words that the reference drive showed."""
        return len(self._words)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Words of a reference view; those not met before are added."""
        words = self.words_of(view.images[self.sensor])
        self._add(words[self._id_of[words] < 0])
        return np.sort(self._id_of[words])

    def observe(self, view: View) -> Observed:
        """Known words of a view."""
        start = time.perf_counter()
        ids = self._id_of[self.words_of(view.images[self.sensor])]
        return Observed(np.sort(ids[ids >= 0]), time.perf_counter() - start)

    def words_of(self, image: NDArray[np.uint8]) -> NDArray[np.int64]:
        """Distinct words of an image, by patch and code, known or not; a patch without any gradient has none."""
        s = self.settings
        descriptors = describe_patches(self._sift, image, s)
        winners = descriptors[:, self._choices].argmax(axis=-1)  # (patches, codes, parts)
        value = np.ravel_multi_index(tuple(np.moveaxis(winners, -1, 0)), (s.among,) * int(s.parts))
        place = np.arange(value.size).reshape(value.shape) * s.among**s.parts
        words: NDArray[np.int64] = (place + value)[descriptors.any(axis=1)].ravel().astype(np.int64)
        return words

    @cached_property
    def _choices(self) -> NDArray[np.intp]:
        """Entries that compete, (codes, parts, among)."""
        s, rng = self.settings, np.random.default_rng(int(self.settings.seed))
        drawn = [rng.permutation(DESCRIPTOR_SIZE)[: int(s.among)] for _ in range(int(s.codes * s.parts))]
        return np.array(drawn).reshape(int(s.codes), int(s.parts), int(s.among))

    def _add(self, words: NDArray[np.int64]) -> None:
        """Give ids to words that have none."""
        self._id_of[words] = len(self._words) + np.arange(len(words))
        self._words = np.concatenate([self._words, words])

    def state(self) -> Mapping[str, NDArray[Any]]:
        """The words met, (size,) int64, in the order of their ids."""
        return {"words": self._words}


def describe_patches(sift: cv2.SIFT, image: NDArray[np.uint8], settings: DenseSettings) -> NDArray[np.uint8]:
    """SIFT descriptors of the grid's patches, (rows · columns, 128), upright, row by row from the top left."""
    width = int(settings.width)
    height = round(width * image.shape[0] / image.shape[1])
    reduced = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    x = (np.arange(settings.columns) + 0.5) * width / settings.columns
    y = (np.arange(settings.rows) + 0.5) * height / settings.rows
    keys = [cv2.KeyPoint(float(u), float(v), settings.patch, 0.0) for v in y for u in x]
    _, descriptors = sift.compute(reduced, keys)
    return np.asarray(descriptors, np.uint8)
