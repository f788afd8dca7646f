"""What of the sensors' readings can be believed, and the last that could where one cannot."""

import math

from robots.odometry import Encoders, Pulses
from robots.signals import LEVEL, Inertial, Signals

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


class Senses:
    """Encoders and inertial sensors as the firmware takes them."""

    def __init__(self, encoders: Encoders) -> None:
        self.angles = 0.0, 0.0
        """Turns of the (left, right) wheel against the body since the start [rad]."""
        self.inertial: Inertial = LEVEL
        self._encoders = encoders
        self._wheels, self._body = _Watched(), _Watched()

    @property
    def left(self) -> float:
        """Turn of the left wheel against the body [rad]."""
        return self.angles[0]

    @property
    def right(self) -> float:
        """Turn of the right wheel against the body [rad]."""
        return self.angles[1]

    @property
    def wheels_believed(self) -> bool:
        """Whether the encoders' newest reading is one."""
        return self._wheels.good

    @property
    def inertial_believed(self) -> bool:
        """Whether the inertial sensors' newest reading is one."""
        return self._body.good

    @property
    def wheels_lost(self) -> bool:
        """Whether the encoders have failed for good."""
        return self._wheels.lost

    @property
    def inertial_lost(self) -> bool:
        """Whether the inertial sensors have failed for good."""
        return self._body.lost

    def trust(self) -> None:
        """Believe all sensors again, until they fail again."""
        self._wheels, self._body = _Watched(), _Watched()

    def hear(self, signals: Signals) -> None:
        """Take the newest readings, where they are such."""
        self._body.look(_plausible(signals.inertial))
        if self._body.good:
            self.inertial = signals.inertial
        self._wheels.look(self._near(signals.pulses))
        if self._wheels.good:
            self.angles = tuple(map(self._encoders.angle, signals.pulses))  # type: ignore[assignment]

    def _near(self, pulses: Pulses) -> bool:
        angles = map(self._encoders.angle, pulses)
        return all(abs(now - last) <= TOP_WHEEL_STEP for now, last in zip(angles, self.angles, strict=True))


def _plausible(inertial: Inertial) -> bool:
    angles, rates = (inertial.pitch, inertial.roll), (inertial.pitch_rate, inertial.yaw_rate)
    return all(abs(angle) <= math.pi for angle in angles) and all(abs(rate) <= TOP_RATE for rate in rates)
