"""Figures of the SICK LMS 200, and the words that it sends.

Sources of the figures are in ``docs/sim.md``.
"""

import math
from dataclasses import dataclass
from enum import Enum

from refseq_bench.sim.errors import SimError

ABOVE_MAX, LOW_SNR, DAZZLE = 8183, 8187, 8190
"""Words that are no ranges: farther than can be said, or nothing there; too little light came back; too much did."""


class RangeMode(Enum):
    """Words of the device in a metre. Words go up to 8182, codes begin at 8183."""

    METRES_8 = 1000
    METRES_80 = 100

    @property
    def max_range(self) -> float:
        """The farthest range that a word can say [m]."""
        return (ABOVE_MAX - 1) / self.value


@dataclass(frozen=True, slots=True)
class LaserModel:
    """Figures of a device; raises ``SimError`` for values that none could have.

    What is nearer than ``min_range`` [m] is reported at it (choice: the device is known to see down to there, and free
    space would be a dangerous answer). Noise is normal, of ``sigma`` [m] and, for the weakest echo that is told from
    noise, ``weak_sigma`` [m] on top. Each device has a bias of its own within ± ``bias_limit`` [m].
    """

    mode: RangeMode = RangeMode.METRES_80
    min_range: float = 0.14
    sigma: float = 0.005
    weak_sigma: float = 0.01
    bias_limit: float = 0.015

    def __post_init__(self) -> None:
        farthest = self.mode.max_range
        if not 0 <= self.min_range < farthest:
            raise SimError(f"laser: min_range = {self.min_range} m must be in [0, {farthest:g} m)")
        for key in ("sigma", "weak_sigma", "bias_limit"):
            if not 0 <= getattr(self, key) < math.inf:
                raise SimError(f"laser: {key} = {getattr(self, key)} m must be 0 or more, and finite")
