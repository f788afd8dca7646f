"""The feature incidence matrix as a picture: features downwards, places to the right, a colour for each extractor."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.viewer.drawing import colours

WIDTH, HEIGHT = 720, 480
"""The picture's size [pixels]."""
LEAST = 38
"""Height of an extractor of a few features only [pixels]."""
GAP = 4
"""Between extractors [pixels]."""
FAINT = 0.25
"""Brightness of a cell that holds few ones among many features."""

SHADES = (
    colours.TRUTH,
    colours.BELIEVED,
    colours.MATCHED,
    colours.WALL,
    colours.UNMATCHED,
    (213, 94, 0),
    (0, 114, 178),
)


@dataclass(frozen=True, slots=True)
class Band:
    """Rows of an extractor's features in the picture: ``top`` to ``bottom`` [pixels], in its colour."""

    key: str
    top: int
    bottom: int
    colour: colours.Colour


def bands(matrix: IncidenceMatrix) -> list[Band]:
    """The extractors from top to bottom, as high as they have features, but never too thin to be seen."""
    sizes = np.array([len(block) for block in matrix.blocks.values()], np.float64)
    free = HEIGHT - GAP * (len(sizes) - 1) - LEAST * len(sizes)
    heights = LEAST + np.floor(free * sizes / max(1.0, sizes.sum())).astype(int)
    tops = np.cumsum([0, *(heights[:-1] + GAP)])
    return [
        Band(key, int(top), int(top + height), SHADES[number % len(SHADES)])
        for number, (key, top, height) in enumerate(zip(matrix.blocks, tops, heights, strict=True))
    ]


def incidence_picture(matrix: IncidenceMatrix) -> NDArray[np.uint8]:
    """The matrix, (``HEIGHT``, ``WIDTH``, 3).

    Where several features or places fall on one pixel its brightness tells which share of them is there, by its root.
    Where one covers several pixels it is drawn as large.
    """
    drawn = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    for band in bands(matrix):
        shares = _shares(matrix, matrix.blocks[band.key], (band.bottom - band.top, WIDTH))
        light = np.where(shares > 0, FAINT + (1 - FAINT) * np.sqrt(shares), 0.0)
        drawn[band.top : band.bottom] = light[..., None] * np.array(band.colour)
    return drawn


def features_a_place(matrix: IncidenceMatrix) -> Mapping[str, NDArray[np.intp]]:
    """Count the features of each extractor at each place, (K,)."""
    return {
        key: np.bincount(matrix.places[_entries(matrix, block)], minlength=matrix.K)
        for key, block in matrix.blocks.items()
    }


def _shares(matrix: IncidenceMatrix, block: range, size: tuple[int, int]) -> NDArray[np.float64]:
    """Shares of ones among the cells that fall on each pixel, (height, width)."""
    if not len(block) or not matrix.K:
        return np.zeros(size)
    cells = min(size[0], len(block)), min(size[1], matrix.K)
    entries = _entries(matrix, block)
    feature = np.repeat(np.arange(len(block)), matrix.sightings(block))
    row = feature * cells[0] // len(block)
    column = matrix.places[entries].astype(np.intp) * cells[1] // matrix.K
    ones = np.bincount(row * cells[1] + column, minlength=cells[0] * cells[1]).reshape(cells)
    high = np.bincount(np.arange(len(block)) * cells[0] // len(block), minlength=cells[0])
    wide = np.bincount(np.arange(matrix.K) * cells[1] // matrix.K, minlength=cells[1])
    shares = ones / np.outer(high, wide)
    at = np.ix_(np.arange(size[0]) * cells[0] // size[0], np.arange(size[1]) * cells[1] // size[1])
    return np.asarray(shares[at], np.float64)


def _entries(matrix: IncidenceMatrix, block: range) -> slice:
    """The entries of an extractor."""
    return slice(int(matrix.pointers[block.start]), int(matrix.pointers[block.stop]))
