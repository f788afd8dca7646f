"""State feedback and estimators, designed from the linear models: the numbers follow from what each weight says."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from robots.segway_rmp.plant import Linear, Matrix, Plant

Vector = NDArray[np.float64]


class GainSet(IntEnum):
    """What the machine is told to balance, by the word of its interface."""

    LIGHT = 0
    TALL = 1
    HEAVY = 2


@dataclass(frozen=True, slots=True)
class Weights:
    """What counts as equally much (Bryson's rule): deviations in units of the state, and the torque spent on them.

    ``integral`` [m·s], ``position`` [m], ``speed`` [m/s], ``pitch`` [rad], ``rate`` [rad/s], ``torque`` [N·m]; choices.
    """

    integral: float = 0.05
    position: float = 0.05
    speed: float = 0.15
    pitch: float = 0.05
    rate: float = 0.3
    torque: float = 15.0


@dataclass(frozen=True, slots=True)
class Load:
    """What a gain set takes for granted on top of the machine as it stands: ``mass`` [kg], ``height`` over the axle."""

    mass: float
    height: float


LOADS: Mapping[GainSet, Load] = MappingProxyType(
    {GainSet.LIGHT: Load(-36.48, 0.50), GainSet.TALL: Load(0.0, 0.0), GainSet.HEAVY: Load(45.0, 0.30)}
)
"""Light is the machine with its rack empty; tall with what our rack and mast carry; heavy 45 kg more. All choices."""
WEIGHTS: Mapping[GainSet, Weights] = MappingProxyType(
    {GainSet.LIGHT: Weights(torque=10.0), GainSet.TALL: Weights(), GainSet.HEAVY: Weights(torque=25.0)}
)

NEVER = 1e8
"""A sensor that says nothing is one whose noise is so many times as large."""


def regulator(system: Linear, deviations: Vector, effort: float) -> Vector:
    """Gains (n,) of the one effort on n states that cost one unit each at their ``deviations`` (n,)."""
    a, b = system
    price = np.array([[1 / effort**2]])
    value = solve_discrete_are(a, b, np.diag(1 / deviations**2), price)
    gains: Vector = np.linalg.solve(price + b.T @ value @ b, b.T @ value @ a)[0]
    return gains


def with_integral(system: Linear, period: float) -> Linear:
    """Return the system with the sum of its first state over time put before its states."""
    states = len(system.a)
    a, b = np.eye(states + 1), np.zeros((states + 1, 1))
    a[1:, 1:], a[0, 1], b[1:] = system.a, period, system.b
    return Linear(a, b)


def carrying(plant: Plant, gain_set: GainSet) -> Plant:
    """Return the machine with what the gain set takes for granted."""
    load = LOADS[gain_set]
    return plant.loaded(load.mass, load.height)


def balancer(plant: Plant, gain_set: GainSet, period: float) -> Vector:
    """Gains (5,) on ∫x, x, ẋ, θ, θ̇: what they give is taken off the torque of both motors."""
    weights = WEIGHTS[gain_set]
    system = carrying(plant, gain_set).pitching().sampled(period)
    deviations = np.array([weights.integral, weights.position, weights.speed, weights.pitch, weights.rate])
    return regulator(with_integral(system, period), deviations, weights.torque)


class Observer:
    """A Kalman filter at its steady state: one gain for each set of sensors that can be believed.

    ``sensing`` (m, n) tells what m sensors read of n states, ``jolts`` (n,) how far the states stray from the model in
    a tick and ``noise`` (m,) how far the readings stray, one standard deviation each.
    """

    def __init__(self, system: Linear, sensing: Matrix, jolts: Vector, noise: Vector) -> None:
        self.state: Vector = np.zeros(len(system.a))
        self._system, self._sensing = system, sensing
        self._jolts, self._noise = np.diag(jolts**2), noise
        self._gains: dict[tuple[bool, ...], Matrix] = {}

    def update(self, effort: float, readings: Vector, believed: tuple[bool, ...]) -> Vector:
        """Go on by a tick under ``effort``, at whose end ``readings`` (m,) were taken, and return the state (n,)."""
        ahead = self._system.a @ self.state + self._system.b[:, 0] * effort
        surprise = np.where(believed, readings - self._sensing @ ahead, 0.0)
        self.state = ahead + self._gain(believed) @ surprise
        return self.state

    def _gain(self, believed: tuple[bool, ...]) -> Matrix:
        if believed not in self._gains:
            self._gains[believed] = self._steady(believed)
        return self._gains[believed]

    def _steady(self, believed: tuple[bool, ...]) -> Matrix:
        a, sees = self._system.a, self._sensing
        if not any(believed):
            return np.zeros_like(sees.T)
        noise = np.diag((self._noise * np.where(believed, 1.0, NEVER**0.5)) ** 2)
        spread = solve_discrete_are(a.T, sees.T, self._jolts, noise)
        gain: Matrix = spread @ sees.T @ np.linalg.inv(sees @ spread @ sees.T + noise)
        return gain
