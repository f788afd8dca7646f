"""Angles and speeds of the Robuter's wheels by their counters."""

from collections import deque

from refseq_bench.robots.motion import WheelSpeeds
from refseq_bench.robots.odometry import Encoders, Pulses

WINDOW = 5
"""Ticks over which wheel speeds are measured: 0.1 s, so that one pulse is 1 mm/s."""


class WheelMeter:
    """Counters of the wheels, and their speeds over the last ticks; keeps the last counters that were numbers."""

    def __init__(self, encoders: Encoders, period: float) -> None:
        self._encoders, self._period = encoders, period
        self._read: deque[Pulses] = deque(maxlen=WINDOW + 1)

    @property
    def counters(self) -> Pulses:
        """The newest."""
        return self._read[-1] if self._read else Pulses(0, 0)

    @property
    def speeds(self) -> WheelSpeeds:
        """Measured speeds of the wheels."""
        if len(self._read) < 2:
            return WheelSpeeds(0.0, 0.0)
        first, last = self._read[0], self._read[-1]
        time = (len(self._read) - 1) * self._period
        turns = (self._encoders.angle(b - a) / time for a, b in zip(first, last, strict=True))
        return WheelSpeeds(*turns)

    def look(self, pulses: Pulses) -> None:
        """Hear the counters of this tick."""
        self._read.append(pulses if pulses.finite else self.counters)

    def rest(self) -> None:
        """Forget that anything moved."""
        self._read = deque([self.counters], maxlen=WINDOW + 1)
