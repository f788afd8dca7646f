"""Exposure control: what a camera's light meter asks for, and how shutter and gain share it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.device_tables import TABLE, Number, require, require_limits

LONGEST_LAG, LONGEST_SHUTTER = 60.0, 10.0
"""Times that a control may have [s]; longer ones are milliseconds by mistake (choices)."""
_BISECTIONS = 40


@dataclass(frozen=True, slots=True)
class ExposureControl:
    """Figures of an exposure control; raises ``SimError`` for values that none could have.

    ``target`` is the mean signal aimed at, as a share of full scale before gamma; ``lag`` [s] is the control's time
    constant; ``shutter`` [s] and ``gain`` are (least, most).
    """

    __pydantic_config__ = TABLE
    target: Number = 0.18  # choice, as all below
    lag: Number = 0.3
    shutter: tuple[Number, Number] = (1e-4, 1 / 15)
    gain: tuple[Number, Number] = (1.0, 16.0)

    def __post_init__(self) -> None:
        require(0.0 < self.target < 1.0, "exposure.target", self.target, "> 0 and < 1")
        require_limits("exposure", shutter=self.shutter, gain=self.gain)
        require(0.0 < self.lag <= LONGEST_LAG, "exposure.lag", self.lag, f"> 0 and <= {LONGEST_LAG:g} s")
        longest = self.shutter[1]
        require(longest <= LONGEST_SHUTTER, "exposure.shutter", longest, f"<= {LONGEST_SHUTTER:g} s")

    @property
    def limits(self) -> tuple[float, float]:
        """Least and most of shutter times gain [s]."""
        return self.shutter[0] * self.gain[0], self.shutter[1] * self.gain[1]


@dataclass(frozen=True, slots=True)
class Exposure:
    """Exposure of a frame: ``shutter`` [s] and analogue ``gain``."""

    shutter: float
    gain: float

    @property
    def product(self) -> float:
        """Shutter times gain [s]: how bright the frame gets."""
        return self.shutter * self.gain


def wanted_exposure(control: ExposureControl, signal: NDArray[np.floating]) -> float:
    """The product of shutter [s] and gain that brings the weighted mean signal to ``target``, within the limits.

    ``signal`` (rows, columns) is the share of full scale that each zone of the light meter gets in 1 s at gain 1. The
    mean is taken of what the sensor could tell, so zones beyond full scale count as full scale: a sun patch on the
    floor does not black out the hallway. It rises with the exposure; bisection on the logarithm finds it.
    """
    weights, signal = centre_weights(*signal.shape), np.asarray(signal, float)
    low, high = (math.log(limit) for limit in control.limits)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if np.sum(weights * np.minimum(signal * math.exp(middle), 1.0)) < control.target:
            low = middle
        else:
            high = middle
    return math.exp((low + high) / 2)


def split_exposure(control: ExposureControl, product: float) -> Exposure:
    """Shutter and gain of a given product [s]: a longer shutter first, as it adds no noise, then gain."""
    shutter = float(np.clip(product / control.gain[0], *control.shutter))
    return Exposure(shutter, float(np.clip(product / shutter, *control.gain)))


def centre_weights(height: int, width: int) -> NDArray[np.float64]:
    """Weights of a light meter, (height, width), sum 1: the centre counts three times the middle of an edge."""
    rows, columns = (0.5 + np.sin(np.pi * (np.arange(n) + 0.5) / n) for n in (height, width))
    weights = np.outer(rows, columns)
    return weights / weights.sum()
