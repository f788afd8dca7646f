"""State feedback and estimators, designed from the linear models: the numbers follow from what each weight says."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.segway_rmp.plant import Linear, Matrix, Plant
from refseq_bench.robots.segway_rmp.protocol import GainSet

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Weights:
    """Deviations that count as equally much (Bryson's rule): in units of the state, and the torque spent on them.

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
    """Load that a gain set takes for granted on top of the machine itself: ``mass`` [kg], ``height`` over the axle."""

    mass: float
    height: float


LOADS: Mapping[GainSet, Load] = MappingProxyType(
    {GainSet.LIGHT: Load(-36.48, 0.50), GainSet.TALL: Load(0.0, 0.0), GainSet.HEAVY: Load(45.0, 0.30)}
)
"""Light is the machine with its rack empty; tall with what our rack and mast carry; heavy 45 kg more. All choices."""
WEIGHTS: Mapping[GainSet, Weights] = MappingProxyType(
    {GainSet.LIGHT: Weights(torque=10.0), GainSet.TALL: Weights(), GainSet.HEAVY: Weights(torque=25.0)}
)


def regulator(system: Linear, deviations: Vector, effort: float) -> Vector:
    """Gains (n,) of the one effort on n states that cost one unit each at their ``deviations`` (n,)."""
    from scipy.linalg import solve_discrete_are  # slow to import: robots are listed and their models read without it

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


@lru_cache(maxsize=16)
def balancer(plant: Plant, gain_set: GainSet, period: float) -> Vector:
    """Gains (5,), read-only, on ∫x, x, ẋ, θ, θ̇: what they give is taken off the torque of both motors."""
    weights = WEIGHTS[gain_set]
    system = carrying(plant, gain_set).pitching().sampled(period)
    deviations = np.array([weights.integral, weights.position, weights.speed, weights.pitch, weights.rate])
    gains = regulator(with_integral(system, period), deviations, weights.torque)
    gains.setflags(write=False)
    return gains


def with_zero(system: Linear) -> Linear:
    """Return the system with a state put after its own that nothing changes: the zero of a sensor."""
    states = len(system.a)
    a, b = np.eye(states + 1), np.zeros((states + 1, 1))
    a[:states, :states], b[:states] = system
    return Linear(a, b)


class StateObserver:
    """A Kalman filter that does with those sensors that can be believed.

    ``sensing`` (m, n) tells what m sensors read of n states, ``jolts`` (n,) how far the states stray from the model in
    a tick, ``noise`` (m,) how far the readings stray, and ``doubt`` (n,) how far from zero the states may be at the
    start: one standard deviation each.
    """

    def __init__(self, system: Linear, sensing: Matrix, jolts: Vector, noise: Vector, doubt: Vector) -> None:
        self.state: Vector = np.zeros(len(system.a))
        self._a, self._b, self._sensing = system.a, system.b[:, 0], sensing
        self._jolts, self._noise = np.diag(jolts**2), noise**2
        self._parts: dict[tuple[bool, ...], tuple[NDArray[np.bool_], Matrix, Matrix]] = {}
        self._spread = np.diag(doubt**2)

    def update(self, effort: float, readings: Vector, believed: tuple[bool, ...]) -> Vector:
        """Go on by a tick under ``effort``, at whose end ``readings`` (m,) were taken, and return the state (n,)."""
        self.state = self._a @ self.state + self._b * effort
        self._spread = self._a @ self._spread @ self._a.T + self._jolts
        if any(believed):
            rows, sensing, noise = self._part(believed)
            self._correct(readings[rows], sensing, noise)
        return self.state

    def _part(self, believed: tuple[bool, ...]) -> tuple[NDArray[np.bool_], Matrix, Matrix]:
        """Readings that are believed, their rows of the states, and their noise."""
        if believed not in self._parts:
            rows = np.array(believed)
            self._parts[believed] = rows, self._sensing[rows], np.diag(self._noise[rows])
        return self._parts[believed]

    def _correct(self, readings: Vector, sensing: Matrix, noise: Matrix) -> None:
        seen = sensing @ self._spread
        gain = np.linalg.solve(seen @ sensing.T + noise, seen).T
        self.state = self.state + gain @ (readings - sensing @ self.state)
        spread = self._spread - gain @ seen
        self._spread = (spread + spread.T) / 2
