"""Which of many places a scan may be of: beams that meet walls on the grid that a fit begins with, at a tenth of a fit.

The ends of the scan's beams are put at all poses of the grid once, and met with the walls of each place. The other way
round, the scan's own walls are a table of cells, in which ends of each place's beams are looked up.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from refseq.pose_graph import motions_between
from refseq.scan_matching.fit import BEAMS, FARTHER, GRID, LaidScan
from refseq.scan_matching.walls import ScanWalls, SeenPoints, seen_from

CELL, WIDE = 0.1, 16.0
"""Cells of the table, and how far it tells ahead and aside [m]: ends of places' beams beyond are not looked up."""
BACK = motions_between(GRID, np.zeros(3))
"""Where the place is as seen from the scan, at each pose of the grid."""
SHIFT = np.round(BACK[:, :2] / CELL).astype(np.intp)
MARGIN = int(np.abs(SHIFT).max()) + 1
"""No pose moves an end of a beam by as many cells."""
SIDE = 2 * (round(WIDE / CELL) + 2 * MARGIN)
ROTATED = len(np.unique(GRID[:, 2]))
"""So many turns the grid has, at each of its spots."""
FLAT = (SHIFT @ [SIDE, 1]).reshape(-1, ROTATED, 1)
"""Cells that each pose moves an end of a beam by, in the table as one row: by spot and turn."""
TO_CELLS = (
    np.array([[[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]] for turn in BACK[:ROTATED, 2]]) / CELL
)
"""Turns of the grid, from metres to cells."""
THROUGH = 256
"""A cell is 1 where walls are met and this where they are seen through, so that one sum counts both."""


class Screen:
    """A view's ``scan``, to be looked for at many places."""

    def __init__(self, scan: LaidScan) -> None:
        self._seen = seen_from(scan.walls.points[::BEAMS], GRID)
        self._table = _table(scan.walls)

    def shares(self, places: Sequence[LaidScan | None]) -> NDArray[np.float64]:
        """The greatest share of beams that meet walls for both, with the scan anywhere on the grid about each place's.

        (n,), of poses far out less, as for a fit; −∞ of a place without a scan.
        """
        return np.array([-np.inf if place is None else self._share(place) for place in places])

    def _share(self, place: LaidScan) -> float:
        met, through = place.walls.met_by(self._seen)
        back = self._table[_cells(place.walls.points[::BEAMS]) + FLAT].sum(axis=-1).ravel()
        met, through = met + back % THROUGH, through + back // THROUGH
        return float((met / np.maximum(met + through, 1) - FARTHER).max())


def _table(walls: ScanWalls) -> NDArray[np.int16]:
    """Walls met and seen through at the middle of each cell, (SIDE²,); a margin of twice ``MARGIN`` tells nothing."""
    at_walls, through = walls.told_of(_seen_cells())
    told = (at_walls + THROUGH * through).astype(np.int16).reshape(SIDE - 4 * MARGIN, -1)
    return np.pad(told, 2 * MARGIN).ravel()


@cache
def _seen_cells() -> SeenPoints:
    """Middles of all cells that tell anything, as the scan sees them."""
    middles = (np.arange(2 * MARGIN, SIDE - 2 * MARGIN) - SIDE / 2 + 0.5) * CELL
    cells = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2)
    return seen_from(cells, np.zeros((1, 3)))


def _cells(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Cells of points (n, 2) at each of the grid's turns, (T, n); those beyond the table are in its margin."""
    cells = np.clip(TO_CELLS @ points.T + SIDE / 2, MARGIN, SIDE - 1 - MARGIN).astype(np.intp)
    return np.asarray(cells[:, 0] * SIDE + cells[:, 1])
