"""A laser's scans, each by itself and against the last one: blind, frozen."""

import math
from dataclasses import dataclass

import numpy as np

from refseq.health.change import MOST, bounded
from refseq.health.pictures import REPEAT
from refseq.view import Scan

USUAL = 0.5
"""At most this share of beams without return is taken to be usual before a drive has shown what is."""

VARIES, LEAST = 0.1, 0.02
"""Scale on which that share varies from view to view: at first, and at least."""

MEMORY = 0.2
"""Weight of a view in the running means of both."""


@dataclass(frozen=True, slots=True)
class ScanRatios:
    """Log-likelihood ratios [nats] of a blind laser and of a frozen one; ``repeated``: the same to the last bit."""

    blind: float
    frozen: float
    repeated: bool


class ScanWatch:
    """Scans of one laser in their order.

    The share of beams without return exceeds its running mean by an exponentially distributed amount on a healthy
    laser, by any amount up to all beams on a blind one: the ratio is s · exp(excess / s), s being how much it varies
    here. In the open, where beams come and go, it takes more to be called blind than in a corridor.
    """

    def __init__(self) -> None:
        self._last: Scan | None = None
        self._usual, self._varies = USUAL, VARIES
        self._way = 0.0

    def update(self, scan: Scan, way: float, *, suspected: bool) -> ScanRatios:
        """Take the next scan, ``way`` [m] of odometry after the last one.

        While the laser is ``suspected`` of being blind the running means stay as they are.
        """
        silent = 1.0 - float(scan.returned.mean()) if len(scan.ranges) else 1.0
        if self._last is None:
            self._usual = min(silent, USUAL)
        excess = max(0.0, silent - self._usual)
        blind = bounded(math.log(self._varies) + excess / self._varies)
        if not suspected and blind <= 0:
            step = abs(silent - self._usual)
            self._usual += MEMORY * (silent - self._usual)
            self._varies = max(LEAST, (1 - MEMORY) * self._varies + MEMORY * 2 * step)
        repeated = self._last is not None and silent < 1 and _same(self._last, scan)
        self._way = self._way + way if repeated else 0.0
        self._last = scan
        return ScanRatios(blind, bounded(self._way / REPEAT) if repeated else -MOST, repeated)


def _same(one: Scan, other: Scan) -> bool:
    return np.array_equal(one.ranges, other.ranges, equal_nan=True)
