"""The light on flat faces as a picture: each face has a grid of points of its own, side by side in one sheet."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.rendering.baked.triangles import HALVES, Floats

WIDTH = 2048
"""Columns of the sheet; a face has no more points along a side than this."""
MARGIN = 1
"""Texels around each chart that repeat its edge: the middle of a pixel at a face's edge may lie beside the face."""
INSET = 0.06
"""Points at a face's edge are lit so far inside it [m]: in the very edge two faces meet."""


@dataclass(frozen=True, slots=True)
class Chart:
    """A face's points, (rows, columns) from its first corner on, at ``column`` and ``row`` of the sheet.

    ``points`` (rows, columns, 3) [m] are where the light is asked, ``whole`` the same of a grid to the face's edges.
    """

    column: int
    row: int
    points: Floats
    whole: Floats
    normal: Floats

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.points.shape[0], self.points.shape[1]

    @property
    def cells(self) -> NDArray[np.intp]:
        """Which points, row by row, are the corners of two triangles for each cell of the grid, (n, 3)."""
        t = np.arange(self.points[..., 0].size).reshape(self.shape)
        corners = np.stack([part.ravel() for part in (t[:-1, :-1], t[:-1, 1:], t[1:, 1:], t[1:, :-1])], axis=1)
        return np.concatenate([corners[:, half] for half in HALVES])

    @property
    def corners(self) -> Floats:
        """Places in the sheet of the face's four corners, (4, 2) [texels]."""
        rows, columns = self.shape
        ends = np.array([[0, 0], [columns - 1, 0], [columns - 1, rows - 1], [0, rows - 1]])
        return ends + np.array([self.column + 0.5, self.row + 0.5])


@dataclass(slots=True)
class Sheet:
    """A sheet that charts are laid out on, in shelves; its first texel stays empty, for what has none."""

    column: int = 1
    row: int = 0
    shelf: int = 1
    charts: list[Chart] = field(default_factory=list)

    def lay(self, face: Floats, longest: float) -> Chart:
        """Lay out a face (4, 3) [m], its points no farther apart than ``longest`` [m]."""
        sides = face[1] - face[0], face[3] - face[0]
        lengths = [float(np.linalg.norm(side)) for side in sides]
        columns, rows = (min(WIDTH - 2 * MARGIN, max(2, math.ceil(length / longest) + 1)) for length in lengths)
        if self.column + columns + 2 * MARGIN > WIDTH:
            self.column, self.row, self.shelf = 0, self.row + self.shelf, 0
        even = [np.linspace(0.0, 1.0, count) for count in (columns, rows)]
        inner = [_inside(places, length) for places, length in zip(even, lengths, strict=True)]
        points, whole = (face[0] + u[None, :, None] * sides[0] + v[:, None, None] * sides[1] for u, v in (inner, even))
        across = np.cross(*sides)
        normal = across / max(float(np.linalg.norm(across)), 1e-12)
        chart = Chart(self.column + MARGIN, self.row + MARGIN, points, whole, normal)
        self.column += columns + 2 * MARGIN
        self.shelf = max(self.shelf, rows + 2 * MARGIN)
        self.charts.append(chart)
        return chart

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return WIDTH, self.row + self.shelf


def _inside(places: Floats, length: float) -> Floats:
    """Move places along a side, 0 to 1, a little off its ends."""
    inset = min(INSET / max(length, 1e-9), 0.25)
    return np.clip(places, inset, 1.0 - inset)
