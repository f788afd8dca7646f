"""The scan itself, discretised: a way to a bit that 2.2.1 names and the thesis leaves unused for the laser.

The nine wall bits and nine boundary bits say what kind of place it is, not which one; a robot that has nothing but a
laser needs more. This feature is not the thesis', so it is on only where it is asked for.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.features.scan_bits import ScanBits
from refseq.view import Scan

SHIFTS = (0.0, 0.5)
"""The grid of sectors and range bins is laid four times, shifted by half a cell either way or not: a robot that comes
by a little turned or to the side leaves some cells, but not all of them."""


@dataclass(frozen=True, slots=True)
class SectorSettings:
    """``sectors`` over the half turn in front; range ``bins`` begin at ``nearest`` [m], each ``growth`` times the last.

    Choices: of the settings tried they found the most revisits among single scans of a real office log (fr079).
    """

    sectors: int = 24
    bins: int = 12
    nearest: float = 0.4
    growth: float = 1.5


class SectorRanges(ScanBits):
    """One bit for each cell that a sector's median range falls in; a sector without returns sets none."""

    key = "sectors/laser"

    def __init__(self, settings: SectorSettings) -> None:
        self.settings = settings
        # A shifted grid needs one more sector, and a bin for what is nearer than the first.
        self._grid = (len(SHIFTS), len(SHIFTS), int(settings.sectors) + 1, int(settings.bins) + 2)

    @property
    def size(self) -> int:
        """Cells of all grids."""
        return int(np.prod(self._grid))

    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that are set."""
        cells = [
            np.ravel_multi_index((i, j, seen, self._bins(steps + reach)), self._grid)
            for i, turn in enumerate(SHIFTS)
            for seen, steps in [self._steps(scan, turn)]
            for j, reach in enumerate(SHIFTS)
        ]
        return np.sort(np.concatenate(cells))

    def _steps(self, scan: Scan, turn: float) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Sectors that see something, in a grid shifted by a share of one, and how many bins away that is."""
        medians = sector_ranges(scan, int(self.settings.sectors), turn)
        seen = np.flatnonzero(np.isfinite(medians))
        ratio = np.maximum(medians[seen], 1e-3) / self.settings.nearest
        return seen, np.log(ratio) / np.log(self.settings.growth) + 1

    def _bins(self, steps: NDArray[np.float64]) -> NDArray[np.intp]:
        return np.clip(np.floor(steps), 0, self.settings.bins + 1).astype(np.intp)


def sector_ranges(scan: Scan, sectors: int, shift: float = 0.0) -> NDArray[np.float64]:
    """Median range in each sector, (sectors + 1,) [m]; inf where half of its beams see nothing.

    Sector ``i`` begins ``i − shift`` sectors' widths after −90°; the last one lies behind 90° unless shifted. Beams
    of a wider scanner that point farther back are left out, so that it makes the same features as one of 180°.
    """
    ahead = np.abs(scan.bearings) <= np.pi / 2 + abs(scan.step) / 2
    index = np.floor((scan.bearings[ahead] + np.pi / 2) / np.pi * sectors + shift).astype(int).clip(0, sectors)
    ranges = scan.ranges[ahead].astype(np.float64)
    ranges = ranges[np.lexsort((ranges, index))]  # sector by sector, each from the nearest on
    count = np.bincount(index, minlength=sectors + 1)
    first, medians = np.cumsum(count) - count, np.full(sectors + 1, np.inf)
    (seen,) = count.nonzero()
    first, count = first[seen], count[seen]
    medians[seen] = (ranges[first + (count - 1) // 2] + ranges[first + count // 2]) / 2
    return medians
