"""The scan itself, discretised: the way to a bit that 2.2.1 names and the thesis leaves unused for the laser.

The nine wall bits and nine boundary bits say what kind of place it is, not which one; a robot that has nothing but a
laser needs more. This feature is not the thesis', so it is on only where it is asked for.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import Observed
from refseq.view import LASER, Scan, View


@dataclass(frozen=True, slots=True)
class SectorSettings:
    """``sectors`` over the half turn in front; ``nearest`` [m] ends the first bin, each next is ``growth`` wider."""

    sectors: int = 36
    bins: int = 12
    nearest: float = 0.5
    growth: float = 1.35


class SectorRanges:
    """One bit for each sector and each bin of its median range; a sector without returns sets none."""

    key = "sectors/laser"
    sensor = LASER

    def __init__(self, settings: SectorSettings) -> None:
        self.settings = settings
        self._edges = settings.nearest * settings.growth ** np.arange(settings.bins - 1)

    @property
    def size(self) -> int:
        """Sectors times bins."""
        return int(self.settings.sectors * self.settings.bins)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Bits of a reference view: the bins are fixed, nothing is added."""
        return self.observe(view).ids

    def observe(self, view: View) -> Observed:
        """Ids of the bits that are set."""
        start = time.perf_counter()
        assert view.scan is not None, "the localiser asks only where the sensor is there"
        medians = sector_ranges(view.scan, int(self.settings.sectors))
        seen = np.flatnonzero(np.isfinite(medians))
        bins = np.searchsorted(self._edges, medians[seen], side="right")
        return Observed(seen * int(self.settings.bins) + bins, time.perf_counter() - start)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Nothing was learnt."""
        return {}


def sector_ranges(scan: Scan, sectors: int) -> NDArray[np.float64]:
    """Median range of the beams in each sector from −90° to 90°, (sectors,) [m]; inf where half of them see nothing."""
    index = np.floor((scan.bearings + np.pi / 2) / np.pi * sectors).astype(int).clip(0, sectors - 1)
    return np.array(
        [np.median(scan.ranges[index == sector]) if (index == sector).any() else np.inf for sector in range(sectors)]
    )
