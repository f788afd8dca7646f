"""Speed regulator of a wheel in the Robuter's processor, by what its encoder counts.

The motors' servos are proportional, and such a one gives way to a load: at a torque τ [N·m] a wheel turns slower by
τ / 400 rad/s, and a turn on the spot, against the scrub of the tyres, would end 0.8 % short. So the processor sums up
how far the wheel is behind what it was told, and asks for more: an integral term.
"""

import math

from refseq_bench.robots.motion import within
from refseq_bench.robots.odometry import Encoders

MOTOR_TORQUE = 30.0
"""Limit of a motor [N·m], as in the model."""
SERVO_GAIN = 400.0
"""Torque by error of speed [N·m·s/rad], as in the model."""
SERVO_LAG = 0.05
"""Time constant with which a servo follows what it is told [s], as in the model: this is no reason to push."""
GAIN = 2.0
"""Speed that is added by the angle that is lacking [1/s]: a choice, ten times as slow as the lag."""
MOST = MOTOR_TORQUE / SERVO_GAIN
"""Most that is added [rad/s]: with this much the servo of a wheel that is held fast gives all that its motor has."""
ROUNDING = 2
"""Pulses that may be missing because counters are whole numbers."""


class Regulator:
    """Regulates one wheel, of which the counter is read every ``period`` [s]."""

    def __init__(self, encoders: Encoders, period: float) -> None:
        self._encoders, self._period = encoders, period
        self._rounding = encoders.angle(ROUNDING)
        self._decay = math.exp(-period / SERVO_LAG)
        self.rest()

    def rest(self) -> None:
        """Begin anew from rest."""
        self._counter: float | None = None
        self._speed = 0.0  # what a servo without load would have the wheel turn with [rad/s]
        self._due = 0.0  # how far it would turn it until the next tick [rad]
        self._behind = 0.0  # how far the wheel is behind that [rad]

    def told(self, wanted: float, counter: float) -> float:
        """Return what to tell the servo for the speed that is ``wanted`` [rad/s]; the wheel's ``counter`` is now there.

        A wheel that is to stand is not pushed: tyres would creep, and what is summed up would burst out later.
        """
        turned = self._encoders.angle(counter - (counter if self._counter is None else self._counter))
        self._counter = counter
        self._behind = within(self._behind + self._due - turned, MOST / GAIN + self._rounding) if wanted else 0.0
        self._expect(wanted)
        return wanted + GAIN * (self._behind - within(self._behind, self._rounding))

    def _expect(self, wanted: float) -> None:
        """Tell what a servo without load does in the coming period."""
        lag = self._speed - wanted
        self._due = wanted * self._period + lag * SERVO_LAG * (1 - self._decay)
        self._speed = wanted + lag * self._decay
