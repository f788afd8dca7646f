"""Stamps of views: going back, standing still, jumping ahead."""

import math

from refseq.health.change import CERTAIN, MOST

PAUSE = 0.01
"""Share of views before which the robot pauses; the length of a pause falls off as its inverse square."""

RANGE = 20.0
"""Logarithm of the range of lengths that a jump may have: from a second to decades."""

LONG = 10.0
"""Factor of the usual time below which a stretch is only a slow one."""

SPEEDS, SHORT = 5.0, 0.5
"""A robot does not go so many times as fast as it has gone so far: in less than this share of the usual time the stamps
are wrong, in more the odometer."""

CLEAR_WAY, SLOW = 0.3, 0.2
"""Way below which the speed is not asked for [m], and the least that counts as a robot's highest speed [m/s]."""

LEAST_TIMES = 3
"""Times between views before which nothing is known to be usual."""

ALIKE = 1.5
"""Long times that differ by no more than this factor are alike."""


class StampWatch:
    """Times between views: the usual ones are about their running mean, some are pauses."""

    def __init__(self) -> None:
        self._last: float | None = None
        self._usual = self._speed = 0.0
        self._seen = 0
        self._long: list[float] = []

    def update(self, time: float, way: float) -> float:
        """Log-likelihood ratio of stamps that jump [nats], at a view ``way`` [m] after the last one."""
        last, self._last = self._last, time
        if last is None:
            return 0.0
        elapsed = time - last
        if not elapsed > 0:
            return CERTAIN
        short = self._seen >= LEAST_TIMES and way > CLEAR_WAY and elapsed < SHORT * self._usual
        if short and way / elapsed > SPEEDS * max(self._speed, SLOW):
            return CERTAIN / 2
        ratio = self._ahead(elapsed)
        if ratio > 0 and self._is_new_usual(elapsed):
            self._usual, ratio = elapsed, 0.0
        if ratio <= 0:
            self._long.clear()
            self._learn(elapsed, way / elapsed)
        return ratio

    def _is_new_usual(self, elapsed: float) -> bool:
        """True for the third long time in a row that is about as long as those before: views come more rarely now."""
        self._long = [one for one in self._long if ALIKE > one / elapsed > 1 / ALIKE] + [elapsed]
        return len(self._long) >= LEAST_TIMES

    def _ahead(self, elapsed: float) -> float:
        """Ratio of a jump ahead, as likely in each decade, to a pause, whose density is PAUSE · usual / elapsed²."""
        if self._seen < LEAST_TIMES or elapsed < LONG * self._usual:
            return -MOST
        return max(-MOST, math.log(elapsed / (RANGE * PAUSE * self._usual)))

    def _learn(self, elapsed: float, speed: float) -> None:
        self._seen += 1
        share = max(0.1, 1 / self._seen)
        self._usual += share * (elapsed - self._usual)
        self._speed = max(self._speed * 0.98, speed)
