"""History of beliefs as one picture of bounded size: place upwards, views to the right, the truth as a blue band.

What is too fine for the picture is not thinned out but joined by the largest: a single sharp belief among 2000 places
stays as bright as it is. The band lies under the belief, never over it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq.viewer.drawing.colours import LOST, TRUTH
from refseq.viewer.drawing.pictures import inferno

CELLS = 160
"""Most columns, and most rows."""
WIDTH, HEIGHT = 360, 224
"""The picture's size [pixels], whatever is in it."""
MARGIN = 8
"""Rows of pixels on top, for marks at views that say lost."""
BAND = 1 / 60
"""Half width of the truth's band, in shares of the picture, but at least ``LEAST`` rows."""
LEAST = 2
DIMMED = 0.42
"""Brightness of the band."""


class History:
    """A picture that takes one belief after the other, of K ``places``.

    With the number of views to ``expect`` they fill its width; without, or when more come, columns are joined in pairs
    whenever it is full.
    """

    def __init__(self, places: int, expect: int | None = None) -> None:
        rows = min(places, CELLS)
        views = CELLS if expect is None else max(1, expect)
        self._stride = math.ceil(views / CELLS)
        self._columns = math.ceil(views / self._stride)
        self._count = 0
        self._starts = np.arange(rows) * places // rows
        self._belief = np.zeros((rows, self._columns), np.uint8)
        self._truth = np.zeros((rows, self._columns), np.bool_)
        self._lost = np.zeros(self._columns, np.bool_)
        self._places = places
        self._rows_drawn = np.arange(HEIGHT - MARGIN)[::-1] * rows // (HEIGHT - MARGIN)
        self._columns_drawn = np.arange(WIDTH) * self._columns // WIDTH
        self._palette = inferno()

    def add(self, belief: Belief, truth: int | None) -> None:
        """Take the next view's belief, and the place where the robot truly is; ``None``: unknown, or off the path."""
        column = self._count // self._stride
        if column == self._columns:
            self._join()
            column = self._count // self._stride
        shades = np.round(255 * np.sqrt(np.clip(belief.places, 0, 1))).astype(np.uint8)
        cells = self._belief[:, column]
        np.maximum(cells, np.maximum.reduceat(shades, self._starts), out=cells)
        if truth is not None:
            row, half = truth * len(cells) // self._places, max(LEAST, round(BAND * len(cells)))
            self._truth[max(0, row - half) : row + half + 1, column] = True
        self._lost[column] |= belief.lost > LOST_ABOVE
        self._count += 1

    def picture(self) -> NDArray[np.uint8]:
        """The picture, (``HEIGHT``, ``WIDTH``, 3), place 0 at the bottom."""
        band = np.round(DIMMED * np.array(TRUTH)).astype(np.uint8)
        cells = np.maximum(self._palette[self._belief], self._truth[..., None] * band)
        drawn = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        drawn[MARGIN:] = cells[np.ix_(self._rows_drawn, self._columns_drawn)]
        drawn[: MARGIN - 2] = self._lost[self._columns_drawn, None] * np.array(LOST, np.uint8)
        return drawn

    def _join(self) -> None:
        """Make room: join neighbouring columns in pairs."""
        for cells in (self._belief, self._truth, self._lost):
            pairs = np.concatenate([cells, cells[..., -1:]], axis=-1) if self._columns % 2 else cells
            joined = np.maximum(pairs[..., ::2], pairs[..., 1::2])
            cells[..., : joined.shape[-1]] = joined
            cells[..., joined.shape[-1] :] = 0
        self._stride *= 2
