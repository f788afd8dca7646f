"""SIFT words of one camera (A.2 to A.4)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.vocabulary import Vocabulary
from refseq.features.word_extractor import KeyWords, PictureKeys

DESCRIPTOR_SIZE = 128
NORM = 512
"""Length of OpenCV's descriptors before they are rounded to bytes."""

_NONE = np.zeros((0, DESCRIPTOR_SIZE), np.uint8)
_NONE.setflags(write=False)
_NOWHERE = np.zeros((0, 2), np.float32)
_NOWHERE.setflags(write=False)


NO_KEYS = PictureKeys(_NOWHERE, _NONE)
"""Those of a blank image, and of one that is missing."""


@dataclass(frozen=True, slots=True)
class SiftSettings:
    """Settings of SIFT: the keys of an image that are used, and the distance within which descriptors are one word.

    ``cap`` is the most features an image gives, strongest first; ``contrast`` is OpenCV's contrast threshold. Keys are
    used from ``first_octave`` to ``last_octave``: −1 is the doubled image, 0 the full and 1 the half resolution.

    OpenCV always begins with the doubled image, even if its keys are not wanted. ``halved`` gives it the half
    resolution, whose doubling stands for the full one; there are then no keys below octave 0. That is a quarter of the
    work. One in four keys is another one, but other images find as many again.

    ``root`` takes the root of each value's share in its descriptor (RootSIFT, Arandjelović and Zisserman 2012), so that
    large values weigh less in a distance.

    Vocabularies of more than ``exact_up_to`` words are matched by an index that misses a few aliases in a thousand.
    """

    cap: int = 200
    contrast: float = 0.04
    alias_distance: float = 250.0
    first_octave: int = 0
    last_octave: int = 1
    halved: bool = False
    root: bool = False
    exact_up_to: int = 20_000


class SiftWords(KeyWords):
    """Words of a camera's image. By default keys on the full and the half-resolution image only, the thesis' choice."""

    settings: SiftSettings

    def __init__(self, camera: str, settings: SiftSettings, words: NDArray[np.uint8] | None = None) -> None:
        super().__init__()
        self.key = f"sift/{camera}"
        self.sensor = camera
        self.settings = settings
        self.vocabulary = Vocabulary(settings.alias_distance, _NONE if words is None else words, settings.exact_up_to)
        self._sift = cv2.SIFT.create(contrastThreshold=settings.contrast)

    def find_keys(self, image: NDArray[np.uint8]) -> PictureKeys:
        """The strongest keys of an image, at most ``cap``; a blank image has none."""
        s = self.settings
        keys, descriptors = self._sift.detectAndCompute(halved(image) if s.halved else image, None)
        if descriptors is None:
            return NO_KEYS
        octaves = np.array([_octave(key) for key in keys]) + s.halved
        used = np.flatnonzero((s.first_octave <= octaves) & (octaves <= s.last_octave))
        response = np.array([key.response for key in keys])[used]
        # A stable order keeps runs identical when two keys are equally strong.
        strongest = used[np.argsort(-response, kind="stable")[: s.cap]]
        chosen = np.asarray(descriptors[strongest], np.uint8)
        return PictureKeys(self._points(keys, strongest), root(chosen) if s.root else chosen)

    def _points(self, keys: Sequence[cv2.KeyPoint], chosen: NDArray[np.intp]) -> NDArray[np.float32]:
        """Points of the chosen keys in the whole image, (n, 2) [pixels]."""
        if len(chosen) == 0:
            return _NOWHERE
        points = np.asarray(cv2.KeyPoint.convert([keys[i] for i in chosen]), np.float32)
        # A pixel of the halved image is the mean of four: its centre lies between theirs.
        return np.asarray(2 * points + 0.5, np.float32) if self.settings.halved else points


def _octave(key: cv2.KeyPoint) -> int:
    """OpenCV packs octave, layer and scale into one integer; the octave is its lowest byte, signed."""
    octave = key.octave & 0xFF
    return octave - 256 if octave >= 128 else octave


def halved(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The image at half the resolution, each pixel the mean of four; one of a single row or column stays."""
    if min(image.shape) < 2:
        return image
    return np.asarray(cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)


def root(descriptors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Roots of the shares that values have of their descriptor's sum, (n, D), as long as SIFT's own, as bytes."""
    shares = descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True, dtype=np.int64), 1)
    rounded: NDArray[np.uint8] = np.minimum(np.rint(NORM * np.sqrt(shares)), 255).astype(np.uint8)
    return rounded
