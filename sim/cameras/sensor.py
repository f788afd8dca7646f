"""From light on the sensor to electrons and to the numbers of the converter, with their noise."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.device_tables import TABLE, Number, Whole, require, require_positive, require_share

PHOTONS_PER_LUX_SECOND = 4.09e15
"""Photons on a square metre in a second at one lux: 1 / 683 W/m² of 3.58e-19 J each, all light at 555 nm."""
WHITE = (1 << 12) - 1
"""Largest number of the analogue-digital converter: 12 bits, a choice."""
FEWEST, MOST = 16, 8192
"""Pixels along a side of a picture: fewer show nothing (choices)."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """Figures of a sensor; raises ``SimError`` for values that none could have.

    ``size``: (width, height) [pixels]; ``pixel`` pitch [m]; ``quantum_efficiency`` in 0…1; ``full_well`` and
    ``read_noise`` [electrons].
    """

    __pydantic_config__ = TABLE
    size: tuple[Whole, Whole] = (640, 480)  # S
    pixel: Number = 5.6e-6  # C
    quantum_efficiency: Number = 0.4  # choice
    full_well: Number = 16_000.0  # M: 13 to 20 thousand
    read_noise: Number = 20.0  # M: 15 to 25

    def __post_init__(self) -> None:
        sane = all(FEWEST <= n <= MOST for n in self.size)
        require(sane, "sensor.size", tuple(self.size), f"two of {FEWEST} to {MOST} pixels")
        require_positive("sensor", pixel=self.pixel, full_well=self.full_well)
        require_share("sensor", quantum_efficiency=self.quantum_efficiency)
        require(0.0 <= self.read_noise < math.inf, "sensor.read_noise", self.read_noise, ">= 0 and finite")

    @property
    def electrons_per_lux_second(self) -> float:
        """Electrons that a pixel gathers from 1 lx on it in 1 s."""
        return self.pixel**2 * PHOTONS_PER_LUX_SECOND * self.quantum_efficiency

    def read(self, mean: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
        """Electrons read from each pixel where ``mean`` are expected, shape as that.

        Shot noise (variance n for n electrons) and read noise come from one normal draw of variance n + r². With r = 20
        electrons the exact sum, a Poisson and a normal variable, has a skewness n / (n + r²)^1.5 below 0.02 for every
        n: nobody could tell, and the draw takes a tenth of the time. No pixel holds more than ``full_well``.
        """
        light = np.maximum(mean, np.float32(0.0))
        electrons = _normal_steps().take(rng.integers(1 << 16, size=mean.shape, dtype=np.uint16))
        electrons *= np.sqrt(light + np.float32(self.read_noise**2))
        electrons += light
        return np.minimum(electrons, np.float32(self.full_well), out=electrons)

    def converted(self, electrons: NDArray[np.float32], gain: float) -> NDArray[np.uint16]:
        """Numbers of the converter, 0 to ``WHITE``: at gain 1 a full well is white. Black is 0: below, nothing."""
        numbers = electrons * np.float32(gain * WHITE / self.full_well)
        np.clip(numbers, 0.0, WHITE, out=numbers)
        numbers += np.float32(0.5)
        return numbers.astype(np.uint16)


@cache
def _normal_steps() -> NDArray[np.float32]:
    """The standard normal distribution in equally likely steps: a sixth of the time of drawing from the continuous one.

    The steps are far below those of the converter; the last one, at 4.3 σ, stands for all beyond, 1 pixel of 65 000.
    """
    from scipy.special import ndtri  # takes long to import, and what only names a camera draws no noise

    return ndtri((np.arange(1 << 16) + 0.5) / (1 << 16)).astype(np.float32)
