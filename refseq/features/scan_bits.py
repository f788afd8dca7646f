"""Base of the laser's extractors with a fixed table of bits."""

from abc import abstractmethod
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import BaseExtractor
from refseq.features.memory import described
from refseq.view import LASER, Scan, View


class ScanBits(BaseExtractor):
    """An extractor whose features are bits that a scan sets, of a table that is fixed: nothing is learnt."""

    key: str
    sensor = LASER

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of bits."""

    @abstractmethod
    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that a scan sets, rising."""

    def learn(self, view: View) -> NDArray[np.intp]:
        """Bits of a reference view."""
        return self.describe(view)

    def describe(self, view: View) -> NDArray[np.intp]:
        """Bits of a view that has a scan."""
        scan = view.scan
        assert scan is not None, "the localiser asks only where the sensor is there"
        settings = self.key, self.table, scan.start, scan.step, scan.max_range
        return described(settings, scan.ranges, lambda _: self.bits(scan))

    @property
    def table(self) -> Hashable:
        """All that decides which bits a scan sets: the settings that the extractor was made with, which are frozen."""
        return tuple(vars(self).values())

    def recognise(self, described: NDArray[np.intp]) -> NDArray[np.intp]:
        """All bits are known."""
        return described

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Nothing was learnt."""
        return {}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """The table is the same everywhere."""
        return np.arange(size)
