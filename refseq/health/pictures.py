"""A camera's pictures: blank, frozen, and how much they have changed."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.health.change import MOST, bounded, gaussian

SIZE = (80, 60)
"""Pictures are compared at this width and height: the noise of single pixels is averaged out. Smaller ones are too
small to tell a frozen camera from a quiet one, and are not judged."""

BLANK, SHOWING = (math.log(0.5), 0.7), (math.log(20.0), 0.85)
"""Mean and deviation of the logarithm of a picture's contrast [grey levels], of nothing and of a scene."""

STANDING, MOVED = (math.log(0.4), 0.5), (math.log(4.0), 1.0)
"""The same of the change from one picture to the next, of a camera that stands and one that has moved."""

REPEAT = 0.1
"""Way within which a camera takes its next picture, as a mean of an exponential distribution [m]."""

SMALLEST = 16
"""Pictures of less to a side [pixels] do not tell places apart: made wider they show nothing more."""

LEAST = 3
"""So many pictures that are the same tell that a camera shows nothing of the way."""


def picture_doubt(pictures: Iterable[NDArray[np.uint8]]) -> str:
    """A sentence for some pictures of a drive that are all the same to the last bit; empty for others.

    No more are decoded than until two differ.
    """
    some = iter(pictures)
    first = next(some, None)
    count = 1
    for picture in some:
        if first is None or not np.array_equal(first, picture):
            return ""
        count += 1
    return "its pictures are all the same: they show nothing of the way" if count >= LEAST else ""


def size_doubt(width: int, height: int) -> str:
    """A sentence for pictures of a size that tells no places apart; empty for others."""
    if min(width, height) >= SMALLEST:
        return ""
    return f"its pictures are of {width} × {height} pixels: too few to tell places apart"


@dataclass(frozen=True, slots=True)
class PictureRatios:
    """Log-likelihood ratios [nats] of a blank camera, a frozen one, and one that has moved since its last picture.

    ``moved`` is 0 where the picture is the same to the last bit, or there was none.
    """

    blank: float
    frozen: float
    moved: float


UNTOLD = PictureRatios(0.0, 0.0, 0.0)
"""Nothing to tell."""


class PictureWatch:
    """Pictures of one camera in their order."""

    def __init__(self) -> None:
        self._last: NDArray[np.uint8] | None = None
        self._levelled: LevelledPicture | None = None
        self._way = 0.0

    def update(self, image: NDArray[np.uint8], way: float) -> PictureRatios:
        """Take the next picture, ``way`` [m] of odometry after the last one."""
        if not is_large(image):
            return UNTOLD
        small = cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA).astype(np.float32)
        blank = gaussian(math.log(max(float(small.std()), 0.1)), BLANK, SHOWING)
        last, before = self._last, self._levelled
        after = levelled(small)
        self._last, self._levelled = image, after
        if last is not None and np.array_equal(last, image):
            self._way += way
            return PictureRatios(bounded(blank), bounded(self._way / REPEAT), 0.0)
        self._way = 0.0
        moved = 0.0 if before is None else gaussian(math.log(max(change(before, after), 0.05)), MOVED, STANDING)
        return PictureRatios(bounded(blank), -MOST, bounded(moved))


def is_large(image: NDArray[np.uint8]) -> bool:
    """True for a picture that is judged: of ``SIZE`` or larger."""
    return bool(image.shape[1] >= SIZE[0] and image.shape[0] >= SIZE[1])


class LevelledPicture(NamedTuple):
    """A picture's ``pixels`` (n,) less their median, and their ``spread``, the median magnitude [grey levels]."""

    pixels: NDArray[np.float32]
    spread: float


def levelled(picture: NDArray[np.float32]) -> LevelledPicture:
    """A picture ready to be compared with others."""
    pixels = (picture - np.median(picture)).ravel()
    return LevelledPicture(pixels, float(np.median(np.abs(pixels))))


def change(before: LevelledPicture, after: LevelledPicture) -> float:
    """Median change of a pixel [grey levels], but for a gain and an offset that all share.

    So neither a lamp that is switched on nor somebody who walks past a standing robot changes the whole picture.
    """
    gain = after.spread / before.spread if before.spread > 0 else 0.0
    return float(np.median(np.abs(after.pixels - gain * before.pixels)))
