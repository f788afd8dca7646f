"""Plausibility of the sensors' readings: those that can be believed, else the last that could."""

import math

from refseq_bench.robots.odometry import Encoders
from refseq_bench.robots.signals import LEVEL, Inertial, Signals

LOST_AFTER = 5
"""So many bad readings one after the other and the sensor is lost for good: a choice, 50 ms, in which a machine that
balances well falls by less than a degree."""
TOP_RATE = 35.0
"""No gyroscope of this kind reads more [rad/s]: 2000 °/s (M)."""
TOP_WHEEL_STEP = 0.5
"""No wheel turns farther in a tick [rad]: at 50 rad/s it would run at 12 m/s (C)."""


class _Watched:
    """One kind of sensor: whether its newest reading is good, and whether it is lost."""

    def __init__(self) -> None:
        self.good, self.lost, self._bad = True, False, 0

    def look(self, good: bool) -> None:
        self._bad = 0 if good else self._bad + 1
        self.lost = self.lost or self._bad >= LOST_AFTER
        self.good = good and not self.lost


class Sensors:
    """Encoders and inertial sensors as far as they can be believed; pairs are of the (left, right) wheel."""

    def __init__(self, encoders: Encoders, period: float) -> None:
        self.angles = 0.0, 0.0
        """Turns of the wheels against the body since the start [rad]."""
        self.rates = 0.0, 0.0
        """Rates at which they turned from the last reading to this one [rad/s], as if no tick had been missed."""
        self.inertial: Inertial = LEVEL
        self._encoders, self._period = encoders, period
        self.trust(self.angles)

    @property
    def wheels_believed(self) -> tuple[bool, bool]:
        """True if the encoders' newest readings are such."""
        return self._wheels[0].good, self._wheels[1].good

    @property
    def wheels_lost(self) -> tuple[bool, bool]:
        """True if the encoders have failed for good."""
        return self._wheels[0].lost, self._wheels[1].lost

    @property
    def inertial_believed(self) -> bool:
        """True if the inertial sensors' newest reading is one."""
        return self._body.good

    @property
    def inertial_lost(self) -> bool:
        """True if the inertial sensors have failed for good."""
        return self._body.lost

    def trust(self, angles: tuple[float, float]) -> None:
        """Believe all sensors again, until they fail again; the encoders count on from ``angles``."""
        self._wheels, self._body = (_Watched(), _Watched()), _Watched()
        self.angles = angles
        self._offsets: list[float | None] = [None, None]

    def hear(self, signals: Signals) -> None:
        """Take the newest readings, where they are such."""
        self._body.look(_plausible(signals.inertial))
        if self._body.good:
            self.inertial = signals.inertial
        last = self.angles
        self.angles = self._turned(0, signals.pulses.left), self._turned(1, signals.pulses.right)
        self.rates = (self.angles[0] - last[0]) / self._period, (self.angles[1] - last[1]) / self._period

    def _turned(self, side: int, pulses: float) -> float:
        """Angle of a wheel: the new one, or the last that could be believed."""
        angle, last = self._encoders.angle(pulses), self.angles[side]
        if self._offsets[side] is None and math.isfinite(angle):
            self._offsets[side] = last - angle
        angle += self._offsets[side] or 0.0
        self._wheels[side].look(abs(angle - last) <= TOP_WHEEL_STEP)
        return angle if self._wheels[side].good else last


def _plausible(inertial: Inertial) -> bool:
    angles, rates = (inertial.pitch, inertial.roll), (inertial.pitch_rate, inertial.yaw_rate)
    return all(abs(angle) <= math.pi for angle in angles) and all(abs(rate) <= TOP_RATE for rate in rates)
