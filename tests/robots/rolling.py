"""Wheels of the Robuter without mass or load: their servos follow what they are told, with their lag."""

import math

import numpy as np

from refseq_bench.robots import Actuation
from refseq_bench.robots.odometry import Encoders, Pulses
from refseq_bench.robots.robuter import PULSES_PER_TURN
from refseq_bench.robots.robuter.firmware import PERIOD
from refseq_bench.robots.robuter.regulator import SERVO_LAG

ENCODERS = Encoders(PULSES_PER_TURN)


class Wheels:
    """``angles`` and ``speeds`` of the (left, right) wheel [rad, rad/s]."""

    def __init__(self) -> None:
        self.angles, self.speeds = np.zeros(2), np.zeros(2)

    @property
    def pulses(self) -> Pulses:
        return ENCODERS.read(*self.angles.tolist())

    def roll(self, told: Actuation) -> None:
        """Go on for a tick: the first-order lag's exact solution."""
        wanted, decay = np.array([told.left, told.right]), math.exp(-PERIOD / SERVO_LAG)
        lag = self.speeds - wanted
        self.angles += wanted * PERIOD + lag * SERVO_LAG * (1 - decay)
        self.speeds = wanted + lag * decay
