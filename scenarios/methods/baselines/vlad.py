"""Images as vectors of locally aggregated descriptors, and how alike two places look by them.

H. Jégou, M. Douze, C. Schmid, P. Pérez, "Aggregating local descriptors into a compact image representation", CVPR 2010;
normalised block by block as in R. Arandjelović, A. Zisserman, "All about VLAD", CVPR 2013; on RootSIFT of the same
authors (CVPR 2012), taken on a dense grid as in A. Torii et al., "24/7 place recognition by view synthesis", CVPR 2015.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features.dense import local_deviation
from refseq.view import View

SIFT_SIZE = 128
PATCH_OF_KEY = 6
"""OpenCV describes a square this many times wider than the key's ``size``."""


@dataclass(frozen=True, slots=True)
class VladSettings:
    """Parameters that make a vector of an image.

    It is shrunk to each of ``widths`` [pixels]; there, descriptors of squares ``patch`` wide are taken every ``step``.
    A square whose grey values have a standard deviation below ``contrast`` shows nothing but noise and is left out.
    ``words`` is the size of the codebook, ``sample`` the most descriptors that it is learnt from, ``rounds`` the
    number of k-means steps. ``tiles`` side by side have a vector of their own each, so that it matters where things
    are in the image.
    """

    widths: tuple[int, ...] = (320, 160)
    step: int = 8
    patch: int = 24
    contrast: float = 2.0
    words: int = 128
    tiles: int = 2
    sample: int = 50_000
    rounds: int = 20


@dataclass(frozen=True, slots=True)
class DenseDescriptors:
    """RootSIFT of one image, (n, 128), and where each lies across it, (n,) in [0, 1)."""

    values: NDArray[np.float32]
    across: NDArray[np.float32]


NOTHING = DenseDescriptors(np.zeros((0, SIFT_SIZE), np.float32), np.zeros(0, np.float32))
"""Those of a blank image, and of one that is missing."""


class DenseSift:
    """Takes RootSIFT on a grid."""

    def __init__(self, settings: VladSettings) -> None:
        self._settings = settings
        self._sift = cv2.SIFT.create()

    def __call__(self, image: NDArray[np.uint8]) -> DenseDescriptors:
        """All descriptors of an image that are not of blank squares; none for a blank image."""
        found = [self._at_width(image, width) for width in self._settings.widths]
        return DenseDescriptors(np.concatenate([f.values for f in found]), np.concatenate([f.across for f in found]))

    def _at_width(self, image: NDArray[np.uint8], width: int) -> DenseDescriptors:
        settings = self._settings
        height = max(1, round(width * image.shape[0] / image.shape[1]))
        small = np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
        deviation = local_deviation(small, settings.patch)
        margin = settings.patch // 2
        grid = [
            (x, y)
            for y in range(margin, height - margin, settings.step)
            for x in range(margin, width - margin, settings.step)
            if deviation[y, x] >= settings.contrast
        ]
        if not grid:
            return NOTHING
        # An angle is given, for without one the descriptor would be turned to no direction in particular.
        keys = [cv2.KeyPoint(float(x), float(y), settings.patch / PATCH_OF_KEY, 0.0) for x, y in grid]
        kept, sift = self._sift.compute(small, keys)
        across = np.array([key.pt[0] for key in kept], np.float32) / np.float32(width)
        return DenseDescriptors(root_sift(np.asarray(sift, np.float32)), across)


def root_sift(sift: NDArray[np.float32]) -> NDArray[np.float32]:
    """Square roots of the shares of each descriptor's sum: Euclidean distances become Hellinger's, (n, 128)."""
    total = np.maximum(sift.sum(axis=1, keepdims=True), 1e-12)
    roots: NDArray[np.float32] = np.sqrt(sift / total)
    return roots


def k_means(points: NDArray[np.float32], count: int, rounds: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """At most ``count`` centres of points (n, D), by Lloyd's steps from points drawn at random; fewer if n is less."""
    centres = points[rng.choice(len(points), min(count, len(points)), replace=False)]
    for _ in range(rounds):
        sums, members = _sums_by_centre(points, centres)
        # A centre without members stays where it is.
        centres = np.where(members[:, None] > 0, sums / np.maximum(members, 1)[:, None], centres).astype(np.float32)
    return centres


def _sums_by_centre(
    points: NDArray[np.float32], centres: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Sum (C, D) and number (C,) of the points nearest to each centre."""
    nearest = np.argmin((centres * centres).sum(axis=1) - 2 * points @ centres.T, axis=1)
    order = np.argsort(nearest, kind="stable")
    members = np.bincount(nearest, minlength=len(centres))
    sums = np.zeros_like(centres)
    there = members > 0
    starts = np.concatenate([[0], np.cumsum(members)[:-1]])
    if len(points):
        sums[there] = np.add.reduceat(points[order], starts[there], axis=0)
    return sums, members


def vlad(points: NDArray[np.float32], centres: NDArray[np.float32]) -> NDArray[np.float32]:
    """Residuals of descriptors (n, D) to their nearest centres (C, D), summed by centre, as one vector (C · D,).

    Each centre's sum gets length 1, so that no texture that fills the image outweighs the rest; then signed square
    roots; then the whole gets length 1. Without descriptors it is zero.
    """
    sums, members = _sums_by_centre(points, centres)
    residuals = sums - members[:, None] * centres
    lengths = np.linalg.norm(residuals, axis=1, keepdims=True)
    blocks = residuals / np.maximum(lengths, 1e-12)
    roots = np.sign(blocks) * np.sqrt(np.abs(blocks))
    vector: NDArray[np.float32] = roots.ravel()
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def tiled_vlad(found: DenseDescriptors, centres: NDArray[np.float32], tiles: int) -> NDArray[np.float32]:
    """Vectors of so many tiles of an image, one behind the other, of length 1 where each shows something."""
    tile = np.minimum((found.across * tiles).astype(int), tiles - 1)
    parts = [vlad(found.values[tile == number], centres) for number in range(tiles)]
    return np.concatenate(parts) / np.float32(np.sqrt(tiles))


@dataclass(frozen=True, slots=True)
class CameraVectors:
    """A camera's codebook, (C, D), and the vectors of all places by it, (K, tiles · C · D)."""

    codebook: NDArray[np.float32]
    places: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Likeness:
    """Cosines between a view and each place, (K,) in [−1, 1], and the time spent on features and on comparing [s].

    ``values`` is ``None`` where the view has no image that could be compared.
    """

    values: NDArray[np.float64] | None
    features: float
    matching: float


class VladMap:
    """The places of a reference drive, each as one vector a camera."""

    def __init__(self, cameras: Mapping[str, CameraVectors], settings: VladSettings) -> None:
        self._cameras, self._settings = cameras, settings
        self._sift = DenseSift(settings)
        self._last: tuple[View, Likeness] | None = None

    @classmethod
    def learn(cls, views: Sequence[View], rng: np.random.Generator, settings: VladSettings | None = None) -> "VladMap":
        """Learn a codebook a camera from the views' images, and describe each view by it.

        Raises ``MapError`` when no view has an image that shows anything.
        """
        settings = settings or VladSettings()
        sift = DenseSift(settings)
        cameras = {}
        for camera in sorted({camera for view in views for camera in view.images}):
            found = [sift(view.images[camera]) if camera in view.images else NOTHING for view in views]
            points = np.concatenate([one.values for one in found])
            if len(points):
                sample = rng.choice(len(points), min(settings.sample, len(points)), replace=False)
                codebook = k_means(points[sample], settings.words, settings.rounds, rng)
                places = np.stack([tiled_vlad(one, codebook, settings.tiles) for one in found])
                cameras[camera] = CameraVectors(codebook, places)
        if not cameras:
            raise MapError(f"{len(views)} views show nothing to describe; valid is a drive with images")
        return cls(cameras, settings)

    def __len__(self) -> int:
        return len(next(iter(self._cameras.values())).places)

    def compare(self, view: View) -> Likeness:
        """Cosine between a view and each place, the mean over the cameras that the view has.

        The last view's answer is kept, for whoever else asks about the same view.
        """
        if self._last is None or self._last[0] is not view:
            self._last = view, self._compare(view)
        return self._last[1]

    def _compare(self, view: View) -> Likeness:
        start = time.perf_counter()
        vectors = {
            camera: tiled_vlad(self._sift(view.images[camera]), learnt.codebook, self._settings.tiles)
            for camera, learnt in self._cameras.items()
            if camera in view.images
        }
        middle = time.perf_counter()
        values = None
        if vectors:
            values = np.mean([self._cameras[camera].places @ vector for camera, vector in vectors.items()], axis=0)
        return Likeness(values, middle - start, time.perf_counter() - middle)


CODEBOOK_SEED = 1
"""Any number will do: it keeps the codebook the same for the same views."""


def as_vlad(views: Sequence[View]) -> VladMap:
    """Views as VLAD, with a codebook of their own."""
    return VladMap.learn(views, np.random.default_rng(CODEBOOK_SEED))
