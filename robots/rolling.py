"""Wheels that roll unevenly, by soft tyres, seams of the floor and castors: a turn of a wheel is now more, now less."""

import math
from typing import NamedTuple

import numpy as np

from refseq_bench.robots.motion import DifferentialDrive
from refseq_bench.robots.wandering import Wandering

LENGTH = 0.5
"""Way over which a wheel's rolling radius keeps its error [m]: a choice, about one turn of a wheel."""


class WheelAngles(NamedTuple):
    """Angles of both wheels [rad]."""

    left: float
    right: float


class UnevenRolling:
    """Angles that encoders would show of wheels that roll as if their radius wandered about its mean.

    ``walk`` [rad/√m] is what it makes of a heading: two wheels whose radii err by σ, correlated over ℓ, turn a robot of
    track b by a random walk of variance 4 ℓ σ² / b² a metre, so that σ = walk · b / (2 √ℓ). The pulses are counted
    wrong where in truth the way is; for whoever integrates them that is the same.
    """

    def __init__(self, walk: float, drive: DifferentialDrive, rng: np.random.Generator) -> None:
        sigma = walk * drive.track / (2 * math.sqrt(LENGTH))
        self._radius = drive.wheel_radius
        self._wheels = [_Wheel(Wandering(sigma, LENGTH, rng)) for _ in WheelAngles._fields] if walk else []

    def seen(self, left: float, right: float) -> WheelAngles:
        """Angles with all errors up to these true angles [rad], the first of which are taken as they are."""
        if not self._wheels or not (math.isfinite(left) and math.isfinite(right)):
            return WheelAngles(left, right)
        radius = self._radius
        return WheelAngles(*(w.seen(a, radius) for w, a in zip(self._wheels, (left, right), strict=True)))


class _Wheel:
    """One wheel: its last true angle, and how far what is seen is ahead of it [rad]."""

    def __init__(self, error: Wandering) -> None:
        self._error, self._last, self._ahead = error, math.nan, 0.0

    def seen(self, angle: float, radius: float) -> float:
        turned = 0.0 if math.isnan(self._last) else angle - self._last
        self._last = angle
        if turned:
            self._error.advance(abs(turned) * radius)
            self._ahead += self._error.value * turned
        return angle + self._ahead
