"""Sparse SIFT of a drive's images, and which keys of a view are those of a place.

D. Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60(2), 2004, section 7.1 for the ratio test;
on RootSIFT: R. Arandjelović, A. Zisserman, "Three things everyone should know to improve object retrieval", CVPR 2012.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features.memory import described
from refseq.features.sift import NO_KEYS as NOTHING_FOUND
from refseq.features.word_extractor import PictureKeys, packed, unpacked
from refseq_bench.scenarios.methods.baselines.vlad import SIFT_SIZE, root_sift


@dataclass(frozen=True, slots=True)
class ImageKeys:
    """Keys of one image: where they are, (n, 2) [pixels], and their RootSIFT, (n, 128), each of length 1."""

    points: NDArray[np.float32]
    descriptors: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.points)


NO_KEYS = ImageKeys(np.zeros((0, 2), np.float32), np.zeros((0, SIFT_SIZE), np.float32))
"""Those of a blank image, and of one that is missing."""


class SparseSift:
    """Finds the keys of images; ``contrast`` is the detector's threshold, OpenCV's own default being 0.04."""

    def __init__(self, contrast: float) -> None:
        self._settings = ("sparse SIFT", contrast)
        self._sift = cv2.SIFT.create(contrastThreshold=contrast)

    def __call__(self, image: NDArray[np.uint8]) -> ImageKeys:
        """All keys of an image, ``NO_KEYS`` for a blank one."""
        points, sift = unpacked(described(self._settings, image, lambda seen: packed(self._found(seen))))
        return ImageKeys(points, root_sift(sift.astype(np.float32))) if len(points) else NO_KEYS

    def _found(self, image: NDArray[np.uint8]) -> PictureKeys:
        """All keys; OpenCV's descriptors are whole numbers up to 255."""
        keys, sift = self._sift.detectAndCompute(image, None)
        if not keys:
            return NOTHING_FOUND
        return PictureKeys(np.array([key.pt for key in keys], np.float32), np.asarray(sift, np.uint8))


@dataclass(frozen=True, slots=True)
class Matches:
    """Keys of a view, (m, 2) [pixels], and the keys of one place that they are taken for, (m, 2) [pixels]."""

    view: NDArray[np.float32]
    place: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.view)


class KeyTable:
    """One camera's keys at all places, kept in batches of places of which each is compared by one matrix product."""

    BATCH = 16_384
    """Keys in a batch, unless one place has more: what a product with 400 keys of a view needs is 25 MB."""

    def __init__(self, places: Sequence[ImageKeys]) -> None:
        if not places:
            raise MapError("no places to match with; valid is a drive of at least one view")
        self._places = places
        self._batches = _batches([len(keys) for keys in places], self.BATCH)
        self._descriptors = [np.concatenate([places[k].descriptors for k in batch]) for batch in self._batches]

    def __len__(self) -> int:
        return len(self._places)

    def matches(self, keys: ImageKeys, ratio: float) -> Iterator[tuple[int, Matches]]:
        """Each place's number with its matches, in order, for places that have any.

        A key of the view and one of the place match when each is the other's nearest, and nearer than ``ratio`` times
        what is second nearest, both among the place's keys and among the view's. Distances are Euclidean. One key alone
        and another alone do not match, for there is nothing to tell them from chance.
        """
        if not len(keys):
            return
        for batch, descriptors in zip(self._batches, self._descriptors, strict=True):
            sizes = np.array([len(self._places[k]) for k in batch])
            cosines = keys.descriptors @ descriptors.T
            ours, theirs = mutual_matches(cosines, sizes, ratio)
            starts = np.concatenate([[0], np.cumsum(sizes)])
            bounds = np.searchsorted(theirs, starts)
            for number, k in enumerate(batch):
                found = slice(bounds[number], bounds[number + 1])
                if found.start < found.stop:
                    points = self._places[k].points[theirs[found] - starts[number]]
                    yield k, Matches(keys.points[ours[found]], points)


def mutual_matches(
    cosines: NDArray[np.float32], sizes: NDArray[np.int64], ratio: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns, (m,) each, columns rising, of the pairs that match within their block of columns.

    ``cosines`` are (n, N) of vectors of length 1 and are overwritten; ``sizes``, all above 0, say how many columns
    belong to each place.
    """
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    place = np.repeat(np.arange(len(sizes)), sizes)
    columns = np.arange(cosines.shape[1])
    nearest = cosines.max(axis=0)
    rows = _first_equal(cosines, nearest)
    mutual = nearest == np.maximum.reduceat(cosines, starts, axis=1)[rows, place]
    # A row may have two nearest columns in a place: neither is nearer than the other.
    mutual[mutual] = _single(rows[mutual] * len(sizes) + place[mutual])
    rows, columns, place, nearest = rows[mutual], columns[mutual], place[mutual], nearest[mutual]
    # With the nearest ones out of the way, the largest that is left is the second.
    cosines[rows, columns] = -np.inf
    second = np.maximum(cosines.max(axis=0)[columns], np.maximum.reduceat(cosines, starts, axis=1)[rows, place])
    distinct = np.isfinite(second) & (_squared(nearest) < ratio**2 * _squared(second))
    return rows[distinct], columns[distinct]


def _first_equal(table: NDArray[np.float32], values: NDArray[np.float32]) -> NDArray[np.intp]:
    """The first row of each column of a table (n, N) in which its value, (N,), is; each is in one.

    With the largest values it is ``argmax`` down the columns, of which NumPy needs four times as long.
    """
    rows, columns = np.divmod(np.flatnonzero(table == values), table.shape[1])
    first = np.empty(len(values), np.intp)
    first[columns[::-1]] = rows[::-1]
    return first


def _single(values: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Mark the values that occur once."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    single: NDArray[np.bool_] = counts[inverse] == 1
    return single


def _squared(cosines: NDArray[np.float32]) -> NDArray[np.float32]:
    """Squared distances of vectors of length 1."""
    squared: NDArray[np.float32] = np.maximum(2 - 2 * cosines, 0)
    return squared


def _batches(sizes: Sequence[int], most: int) -> list[list[int]]:
    """Numbers of the places that have keys, in order, cut so that each list has at most ``most`` keys or one place."""
    batches: list[list[int]] = []
    total = most
    for k, size in enumerate(sizes):
        if not size:
            continue
        if total + size > most:
            batches.append([])
            total = 0
        batches[-1].append(k)
        total += size
    return batches
