"""What the laser's fixed tables of bits have in common."""

import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import Observed
from refseq.view import LASER, Scan, View


class ScanBits(ABC):
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
        return self.observe(view).ids

    def observe(self, view: View) -> Observed:
        """Bits of a view that has a scan."""
        start = time.perf_counter()
        assert view.scan is not None, "the localiser asks only where the sensor is there"
        return Observed(self.bits(view.scan), time.perf_counter() - start)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Nothing was learnt."""
        return {}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """The table is the same everywhere."""
        return np.arange(size)

    def adopted(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """The table is the same everywhere."""
        return np.arange(size)
