"""Words of a grid of patches: what an image looks like where SIFT finds no keys (a feature of ours).

A blank wall has few corners but still edges, shades and a skirting board. Every cell of a coarse grid is described by
the orientations of its gradients (a SIFT descriptor at a fixed place, on a reduced image), and each description is
turned into words by winner-take-all codes (J. Yagnik et al., "The power of comparative reasoning", ICCV 2011): which of
some entries, drawn once, is the largest. Only the order of the entries counts, so that a change of light that keeps it
keeps the word.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import BaseExtractor
from refseq.features.memory import described
from refseq.features.sift import DESCRIPTOR_SIZE
from refseq.view import View

SLENDER = 16
"""A picture that is so many times as long as wide is no view; panoramas have 8."""


@dataclass(frozen=True, slots=True)
class DenseSettings:
    """``columns`` × ``rows`` patches of key size ``patch`` on an image reduced to ``width`` pixels.

    A SIFT descriptor looks at a square of about six times its key size. A patch is left out when the grey values in its
    middle, ``middle`` pixels wide, have a standard deviation below ``contrast``: it would describe the camera's noise.
    Each patch gives ``codes`` words, a word being the winner among ``among`` entries of the descriptor that are drawn
    with ``seed``.
    """

    width: int = 320
    columns: int = 8
    rows: int = 6
    patch: float = 26.0
    middle: int = 48
    contrast: float = 2.0
    codes: int = 8
    among: int = 16
    seed: int = 2011


class DenseWords(BaseExtractor):
    """Words of one camera's image, up to ``columns`` · ``rows`` · ``codes`` of them: a bland patch has none."""

    def __init__(self, camera: str, settings: DenseSettings, words: NDArray[np.int64] | None = None) -> None:
        self.key = f"dense/{camera}"
        self.sensor = camera
        self.settings = settings
        self._sift = cv2.SIFT.create()
        self._words = np.zeros(0, np.int64)
        self._id_of = np.full(settings.columns * settings.rows * settings.codes * settings.among, -1, np.int64)
        if words is not None:
            words = np.asarray(words, np.int64)
            if (outside := words[(words < 0) | (words >= len(self._id_of))]).size:
                raise ValueError(f"{self.key} has word {int(outside[0])}; valid are 0 to {len(self._id_of) - 1}")
            self._add(words)

    @property
    def size(self) -> int:
        """Number of words that the reference drive showed."""
        return len(self._words)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Words of a reference view; those not met before are added."""
        words = self.describe(view)
        self._add(words[self._id_of[words] < 0])
        return np.sort(self._id_of[words])

    def describe(self, view: View) -> NDArray[np.int64]:
        """Words of a view."""
        return described(self.settings, view.images[self.sensor], self.words_of)

    def recognise(self, described: NDArray[np.int64]) -> NDArray[np.intp]:
        """Those that are known."""
        ids = self._id_of[described].astype(np.intp)
        return np.sort(ids[ids >= 0])

    def words_of(self, image: NDArray[np.uint8]) -> NDArray[np.int64]:
        """Distinct words of an image, by patch and code, known or not; a blank patch has none."""
        patches = describe_patches(self._sift, image, self.settings)
        winners = patches.descriptors[:, self._choices].argmax(axis=-1)  # (n, codes)
        codes, among = winners.shape[1], self.settings.among
        words: NDArray[np.int64] = (patches.numbers[:, None] * codes + np.arange(codes)) * among + winners
        return words.ravel()

    @cached_property
    def _choices(self) -> NDArray[np.intp]:
        """Entries that compete, (codes, among)."""
        s, rng = self.settings, np.random.default_rng(self.settings.seed)
        return np.array([rng.permutation(DESCRIPTOR_SIZE)[: s.among] for _ in range(s.codes)])

    def _add(self, words: NDArray[np.int64]) -> None:
        """Give ids to words that have none."""
        self._id_of[words] = len(self._words) + np.arange(len(words))
        self._words = np.concatenate([self._words, words])

    def state(self) -> Mapping[str, NDArray[Any]]:
        """The words met, (size,) int64, in the order of their ids."""
        return {"words": self._words}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """The same words, whatever their numbers."""
        ids: NDArray[np.intp] = self._id_of[state["words"]].astype(np.intp)
        return ids


class GridPatches(NamedTuple):
    """Patches of an image that show something: which they are, (n,), row by row from the top left, and (n, 128)."""

    numbers: NDArray[np.int64]
    descriptors: NDArray[np.uint8]


def describe_patches(sift: cv2.SIFT, image: NDArray[np.uint8], settings: DenseSettings) -> GridPatches:
    """Upright SIFT descriptors of the grid's patches, those without contrast left out.

    A strip, longer than ``SLENDER`` times its width, has none: its reduced image would have no bound.
    """
    if max(image.shape) > SLENDER * min(image.shape):
        return GridPatches(np.zeros(0, np.int64), np.zeros((0, DESCRIPTOR_SIZE), np.uint8))
    height = max(1, round(settings.width * image.shape[0] / image.shape[1]))
    reduced = np.asarray(cv2.resize(image, (settings.width, height), interpolation=cv2.INTER_AREA), np.uint8)
    x = (np.arange(settings.columns) + 0.5) * settings.width / settings.columns
    y = (np.arange(settings.rows) + 0.5) * height / settings.rows
    deviation = local_deviation(reduced, settings.middle)[np.ix_(y.astype(int), x.astype(int))]
    shown = np.flatnonzero(deviation.ravel() >= settings.contrast)
    # An angle is given, for without one the descriptor would be turned to no direction in particular.
    keys = [cv2.KeyPoint(float(x[n % len(x)]), float(y[n // len(x)]), settings.patch, 0.0) for n in shown]
    if not keys:
        return GridPatches(shown, np.zeros((0, DESCRIPTOR_SIZE), np.uint8))
    _, descriptors = sift.compute(reduced, keys)
    return GridPatches(shown, np.asarray(descriptors, np.uint8))


def local_deviation(image: NDArray[np.uint8], side: int) -> NDArray[np.float32]:
    """Standard deviation of the grey values in the square around each pixel, (height, width)."""
    grey = image.astype(np.float32)
    mean = cv2.blur(grey, (side, side))
    variance = cv2.blur(grey * grey, (side, side)) - mean * mean
    return np.asarray(np.sqrt(np.maximum(variance, 0)), np.float32)
