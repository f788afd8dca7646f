"""SIFT words of one camera (A.2 to A.4)."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import Observed
from refseq.features.vocabulary import Vocabulary
from refseq.view import View

FULL_RESOLUTION, HALF_RESOLUTION = 0, 1
"""OpenCV's octaves: −1 is the doubled image, which the thesis does not use."""

_NONE = np.zeros((0, 128), np.uint8)
_NONE.setflags(write=False)


@dataclass(frozen=True, slots=True)
class SiftSettings:
    """``cap`` is the most features an image gives, strongest first; ``contrast`` is OpenCV's contrast threshold."""

    cap: int = 200
    contrast: float = 0.04
    alias_distance: float = 250.0


class SiftWords:
    """Words of a camera's image: keys on the full and the half-resolution image only, at most ``cap`` of them."""

    def __init__(self, camera: str, settings: SiftSettings, words: NDArray[np.uint8] | None = None) -> None:
        self.key = f"sift/{camera}"
        self.sensor = camera
        self.settings = settings
        self.vocabulary = Vocabulary(settings.alias_distance, _NONE if words is None else words)
        self._sift = cv2.SIFT.create(contrastThreshold=settings.contrast)

    @property
    def size(self) -> int:
        """How many words there are."""
        return len(self.vocabulary)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Words of a reference view; unknown descriptors become words."""
        return np.unique(self.vocabulary.learn(self.descriptors(view.images[self.sensor])))

    def observe(self, view: View) -> Observed:
        """Words seen in a view."""
        start = time.perf_counter()
        descriptors = self.descriptors(view.images[self.sensor])
        middle = time.perf_counter()
        ids = self.vocabulary.match(descriptors)
        return Observed(ids, middle - start, time.perf_counter() - middle)

    def descriptors(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Descriptors of the strongest keys, (n, 128), n ≤ ``cap``; a blank image gives none."""
        keys, descriptors = self._sift.detectAndCompute(image, None)
        if descriptors is None:
            return _NONE
        used = np.array([_octave(key) in (FULL_RESOLUTION, HALF_RESOLUTION) for key in keys])
        response = np.array([key.response for key in keys])
        # A stable order keeps runs identical when two keys are equally strong.
        strongest = np.argsort(-response[used], kind="stable")[: self.settings.cap]
        return np.asarray(descriptors[used][strongest], np.uint8)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """The words, (size, 128) uint8."""
        return {"words": self.vocabulary.words}


def _octave(key: cv2.KeyPoint) -> int:
    """OpenCV packs octave, layer and scale into one integer; the octave is its lowest byte, signed."""
    octave = key.octave & 0xFF
    return octave - 256 if octave >= 128 else octave
