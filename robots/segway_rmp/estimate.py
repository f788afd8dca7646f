"""State estimate of the machine's motion, from its sensors and from what its motors gave."""

import math
from typing import NamedTuple

import numpy as np

from refseq_bench.robots.odometry import Encoders
from refseq_bench.robots.segway_rmp.balance import StateObserver, Vector, with_zero
from refseq_bench.robots.segway_rmp.plant import Plant
from refseq_bench.robots.segway_rmp.sensors import Sensors
from refseq_bench.robots.signals import Signals

ZERO = math.radians(2)
"""The pitch sensor's zero, or an off-centre load, can be off by so much at most [rad]: a choice. What leans farther
over and does not run away leans on something."""


class Yaw(NamedTuple):
    """Heading [rad] and turn rate [rad/s]."""

    heading: float
    rate: float


class MotionEstimate:
    """Filters over the machine's ``sensors``, asked every ``period`` [s]; pairs are of the (left, right) wheel."""

    def __init__(self, plant: Plant, encoders: Encoders, period: float) -> None:
        self.sensors = Sensors(encoders, period)
        self._plant, self._period = plant, period
        self._angles = 0.0, 0.0  # turns of the wheels against the body [rad]
        self._pitching = self._filter(np.zeros(4), balancing=False)
        self._yawing = StateObserver(
            plant.yawing().sampled(period),
            np.eye(2),
            jolts=np.array([1e-5, 1e-2]),
            noise=np.array([4e-4, 3e-3]),
            doubt=np.array([1e-3, 1e-2]),
        )

    @property
    def state(self) -> Vector:
        """x, ẋ, θ, θ̇ (4,) of the pendulum."""
        return self._pitching.state[:4]

    @property
    def zero(self) -> float:
        """Estimated reading of the pitch sensor while the machine is upright [rad]."""
        return float(self._pitching.state[4])

    @property
    def yaw(self) -> Yaw:
        """Where the machine looks, and how fast it turns."""
        return Yaw(*self._yawing.state.tolist())

    @property
    def ways(self) -> tuple[float, float]:
        """Ways of the wheels' rims over the floor [m]."""
        swung, radius = float(self.state[2]), self._plant.wheel_radius
        # A wheel that stands turns against a body that leans over.
        return radius * (self._angles[0] + swung), radius * (self._angles[1] + swung)

    def begin(self, *, balancing: bool) -> None:
        """Go on from the present state, on two wheels or on a third support."""
        self._pitching = self._filter(self.state, balancing=balancing)

    def begin_anew(self) -> None:
        """Believe all sensors again; the ways go on where they were last known."""
        self.sensors.trust(self._angles)
        self._pitching.state[0] = sum(self.ways) / 2

    def rest(self) -> None:
        """Nothing moves, and the machine is upright; the ways stay as they are."""
        self._pitching.state[1:4] = self._yawing.state[1:] = 0.0

    def hear(self, signals: Signals, torques: tuple[float, float]) -> None:
        """Go on by a tick, in which the motors gave ``torques`` [N·m] and at whose end ``signals`` were read."""
        sensors, (left, right) = self.sensors, torques
        sensors.hear(signals)
        self._angles = self._wheel_angles()
        half, radius = self._plant.track / 2, self._plant.wheel_radius
        rolled = radius * (self._angles[0] + self._angles[1]) / 2
        turned = radius * (self._angles[1] - self._angles[0]) / 2 / half
        (left_good, right_good), body = sensors.wheels_believed, sensors.inertial_believed
        readings = np.array([rolled, sensors.inertial.pitch, sensors.inertial.pitch_rate])
        state = self._pitching.update(left + right, readings, (left_good or right_good, body, body))
        state[4] = min(max(state[4], -ZERO), ZERO)
        readings = np.array([turned, sensors.inertial.yaw_rate])
        self._yawing.update(right - left, readings, (left_good and right_good, body))

    def _wheel_angles(self) -> tuple[float, float]:
        """Turns of the wheels against the body [rad]: where one is not known, the other and the heading tell it."""
        (left, right), (left_good, right_good) = self.sensors.angles, self.sensors.wheels_believed
        apart = self._plant.track * self.yaw.heading / self._plant.wheel_radius
        if left_good == right_good:
            return left, right
        return (left, left + apart) if left_good else (right - apart, right)

    def _filter(self, state: Vector, *, balancing: bool) -> StateObserver:
        """A filter for the motion, from a state on: x, ẋ, θ, θ̇, and the zero of the pitch sensor.

        Where the machine balances, its motion tells where upright is: a sensor that is off, or a load that is not in
        the middle, is the same to it. How far model and sensors stray are choices.
        """
        model, radius = self._plant.pitching() if balancing else self._plant.standing(), self._plant.wheel_radius
        observer = StateObserver(
            with_zero(model.sampled(self._period)),
            np.array(
                [[1.0, 0.0, -radius, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, float(balancing)], [0.0, 0.0, 0.0, 1.0, 0.0]]
            ),
            jolts=np.array([1e-5, 3e-3, 1e-5, 3e-3, 1e-5]),
            noise=np.array([1e-4, 2e-3, 3e-3]),
            doubt=np.array([1e-3, 1e-2, 1e-2, 1e-2, 1e-2]),
        )
        observer.state[:4] = state
        return observer
