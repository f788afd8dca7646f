"""Keys of one camera at the views of a path, as a map keeps them: few, and in half of their bits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from refseq.features.sift import DESCRIPTOR_SIZE
from refseq.features.word_extractor import PictureKeys

MOST = 200
"""Keys of a view that are kept, the strongest: more were no better on the worlds chosen on, and 100 a little worse."""
STEP = 8
"""Positions are kept in so many steps a pixel."""
PACKED_SIZE = DESCRIPTOR_SIZE // 2
"""Bytes of a descriptor: the upper four bits of each of its values."""
FARTHEST = 65535
"""Largest position in steps: 8191 pixels."""


@dataclass(frozen=True, eq=False)
class PathKeys:
    """Keys of all V views, one behind the other: ``counts`` (V,) says how many each has, at most ``MOST``.

    ``points`` (M, 2) are x and y in ``STEP`` steps a pixel, ``packed`` (M, 64) two values of a descriptor a byte: 68
    bytes a key.
    """

    counts: NDArray[np.int32]
    points: NDArray[np.uint16]
    packed: NDArray[np.uint8]

    @classmethod
    def of(cls, views: Sequence[PictureKeys]) -> Self:
        """Those of some views, each in the order of their strength."""
        points = np.concatenate([np.zeros((0, 2), np.float32), *(keys.points[:MOST] for keys in views)])
        found = [np.zeros((0, DESCRIPTOR_SIZE), np.uint8), *(keys.descriptors[:MOST] for keys in views)]
        descriptors = np.concatenate(found)
        counts = np.array([min(len(keys.points), MOST) for keys in views], np.int32)
        steps = np.clip(np.rint(points * STEP), 0, FARTHEST).astype(np.uint16)
        packed = np.asarray((descriptors[:, ::2] & 0xF0) | (descriptors[:, 1::2] >> 4), np.uint8)
        return cls(counts, steps, packed)

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        return np.cumsum([0, *self.counts.tolist()])

    def only(self, held: NDArray[np.bool_]) -> Self:
        """Those of the views ``held`` (V,): all others have none."""
        its = np.repeat(held, self.counts)
        return type(self)(np.where(held, self.counts, np.int32(0)), self.points[its], self.packed[its])

    def at(self, view: int) -> PictureKeys:
        """The keys of a view; each value of a descriptor is the middle of those that share its upper bits."""
        its = slice(self._starts[view], self._starts[view + 1])
        descriptors = np.empty((its.stop - its.start, DESCRIPTOR_SIZE), np.uint8)
        descriptors[:, ::2] = self.packed[its] & 0xF0
        descriptors[:, 1::2] = self.packed[its] << 4
        return PictureKeys((self.points[its] / STEP).astype(np.float32), descriptors + np.uint8(8))
