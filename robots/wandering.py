"""Ornstein–Uhlenbeck process: an error that wanders about zero over a way or a time."""

import math

import numpy as np


class Wandering:
    """Sampled exactly: standard deviation ``sigma``, correlation e⁻¹ over ``scale``; begins anywhere."""

    def __init__(self, sigma: float, scale: float, rng: np.random.Generator) -> None:
        self._sigma, self._scale, self._rng = sigma, scale, rng
        self.value = sigma * float(rng.normal())

    def advance(self, by: float) -> None:
        """Let the process run on."""
        keep = math.exp(-by / self._scale)
        self.value = keep * self.value + self._sigma * math.sqrt(1 - keep * keep) * float(self._rng.normal())
