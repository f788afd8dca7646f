"""Similarity of the views of a map's paths, and the places that paths share."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.similarity import view_similarity
from refseq.map.map import Map
from refseq.map.paths.path import MapPath

STEP = 2
"""Views of a stretch that two paths share lie at most so far apart in either: merging goes by the nearest place."""
MOST_PIXELS = 4096
"""A picture is no wider, viewers hold no larger ones: where there are more views, a pixel is the brightest of some."""


@dataclass(frozen=True)
class SharedStretch:
    """A stretch of places that two paths run through: ``views`` (n, 2) are the numbers in ``one`` and in ``other``."""

    one: int
    other: int
    views: NDArray[np.intp]


def shared_stretches(map_: Map) -> list[SharedStretch]:
    """All stretches that two paths share, each once, by the paths' numbers."""
    found = []
    for one, path in enumerate(map_.paths):
        for other in range(one + 1, len(map_.paths)):
            found += [SharedStretch(one, other, views) for views in _stretches(map_, path, map_.paths[other])]
    return found


def _stretches(map_: Map, one: MapPath, other: MapPath) -> list[NDArray[np.intp]]:
    ours, theirs = map_.numbered(one), map_.numbered(other)
    pairs = np.argwhere(ours[:, None] == theirs[None, :])
    if not len(pairs):
        return []
    breaks = np.flatnonzero((np.abs(np.diff(pairs, axis=0)) > STEP).any(axis=1)) + 1
    return np.split(pairs, breaks)


@dataclass(frozen=True)
class Mosaic:
    """The similarity of all paths with all paths, side by side in one square of ``size`` views either way.

    Views that are looked for run to the right, places upwards; ``first`` (P + 1,) is where each path begins on either
    axis. A view of a path is the place that it is at now, and what is drawn is what the sequence that holds a place
    answers to it, under a uniform prior: the square root of its probability, as brightness.
    """

    map: Map

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """First view of each path, and the number of all."""
        return np.cumsum([0, *map(len, self.map.paths)])

    @property
    def size(self) -> int:
        """Number of views of all paths."""
        return int(self.first[-1])

    @property
    def unit(self) -> int:
        """Number of views a pixel."""
        return -(-self.size // MOST_PIXELS)

    @property
    def side(self) -> int:
        """Width and height of the picture [pixels]."""
        return -(-self.size // self.unit)

    def at(self, looked_for: int, found: int, views: NDArray[np.intp]) -> NDArray[np.float64]:
        """Positions in the picture, (n, 2) [pixels], of pairs of views (n, 2) of two paths, by the paths' numbers.

        A view is a pixel wide: whole numbers are meant to be its middle.
        """
        right = (self.first[looked_for] + views[:, 0] + 0.5) / self.unit
        up = (self.first[found] + views[:, 1] + 0.5) / self.unit
        return np.stack([right, self.side - up], axis=1)

    def grey(self) -> NDArray[np.uint8]:
        """The picture before it is coloured, place 0 of the first path in the bottom left corner."""
        places = np.concatenate([self.map.numbered(path) for path in self.map.paths])
        whole = self._of_places()[np.ix_(places, places)].T[::-1]
        return _pooled(whole, self.unit)

    def _of_places(self) -> NDArray[np.uint8]:
        """Brightness of what each place, a row, is told to be among all places, (K, K)."""
        first, sequences = self.map.first, self.map.sequences
        found = np.empty((len(self.map), len(self.map)), np.uint8)
        for i, of in enumerate(sequences):
            for j, to in enumerate(sequences):
                alike = np.sqrt(view_similarity(of, to))
                found[first[i] : first[i + 1], first[j] : first[j + 1]] = np.round(255 * alike)
        return found


def _pooled(image: NDArray[np.uint8], unit: int) -> NDArray[np.uint8]:
    """The brightest of each square of ``unit`` pixels; the last row and column of squares may be narrower.

    Squares are laid from the bottom left corner, where the first place of the first path is.
    """
    if unit == 1:
        return np.ascontiguousarray(image)
    height, width = image.shape
    padded = np.pad(image, ((-height % unit, 0), (0, -width % unit)))
    return np.asarray(padded.reshape(len(padded) // unit, unit, -1, unit).max(axis=(1, 3)))
