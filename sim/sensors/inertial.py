"""Inertial sensors: pitch and roll, rates of pitch and yaw, each off by a bias and by noise."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots import Inertial
from refseq_bench.sim.errors import SimError


@dataclass(frozen=True, slots=True)
class InertialModel:
    """Errors of the sensors, one standard deviation each: all choices.

    Biases are drawn once for a drive, noise at every reading. Angles [rad], rates [rad/s].
    """

    angle_bias: float = math.radians(0.2)
    angle_noise: float = math.radians(0.05)
    rate_bias: float = math.radians(0.05)
    rate_noise: float = math.radians(0.1)

    def __post_init__(self) -> None:
        for key in ("angle_bias", "angle_noise", "rate_bias", "rate_noise"):
            if not 0 <= getattr(self, key) < 0.2:
                raise SimError(f"inertial sensors: {key} = {getattr(self, key)} must be in [0, 0.2)")


class InertialSensors:
    """The sensors of one robot on one drive."""

    def __init__(self, model: InertialModel, rng: np.random.Generator) -> None:
        angle, rate = model.angle_bias, model.rate_bias
        self._bias = (rng.normal(0.0, 1.0, 4) * (angle, angle, rate, rate)).tolist()
        self._noise = (model.angle_noise, model.angle_noise, model.rate_noise, model.rate_noise)
        self._rng = rng

    def read(self, rotation: NDArray[np.float64], rates: NDArray[np.float64]) -> Inertial:
        """Read a body's ``rotation`` (w x y z) and its angular velocity in its own frame (3,) [rad/s]."""
        true = (*tilt(rotation), float(rates[1]), float(rates[2]))
        drawn = self._rng.standard_normal(4).tolist()
        # Four numbers in each tick: arrays of them would take longer.
        return Inertial(*(t + b + s * d for t, b, s, d in zip(true, self._bias, self._noise, drawn, strict=True)))


def tilt(rotation: NDArray[np.float64]) -> tuple[float, float]:
    """Pitch, nose down, and roll, left side up [rad], of a body turned by a quaternion (w x y z).

    As seen from the body's direction of gravity: pitch is beyond ±90° where it is upside down, roll never.
    """
    w, x, y, z = rotation.tolist()
    ahead, aside, up = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return math.atan2(-ahead, math.hypot(aside, up) * (1.0 if up >= 0 else -1.0)), math.atan2(aside, abs(up))
