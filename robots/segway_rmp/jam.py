"""Tells of a wheel that stands still although its motor has pushed it enough to make any free wheel turn."""

import math

from refseq_bench.robots.signals import Signals

HOLDING = 15.0
"""Torque that a motor may always give while its wheel stands [N·m]: a choice, enough to stand on a slope of 8° (C)."""
IMPULSE = 4.0
"""Impulse that it may give beyond that [N·m·s]: a choice. A free wheel would have been set rolling at 0.2 m/s (C)."""


class JamWatch:
    """Looks at both wheels; what turns by fewer than ``slack`` pulses stands still: gears give way a little.

    A machine that balances cannot wait until a motor has pushed as hard as it can for a second: it would have fallen.
    """

    def __init__(self, slack: float) -> None:
        self._slack = slack
        self._given, self._places = [0.0, 0.0], [0.0, 0.0]
        self._time: float | None = None

    def look(self, signals: Signals) -> str | None:
        """Tell which wheel is jammed now, None when both are free."""
        elapsed = 0.0 if self._time is None else signals.time - self._time
        self._time = signals.time
        for side, name in enumerate(("left", "right")):
            self._push(side, signals.torques[side], elapsed)
            if not abs(signals.pulses[side] - self._places[side]) <= self._slack:
                self._given[side], self._places[side] = 0.0, signals.pulses[side]
            elif abs(self._given[side]) > IMPULSE:
                return f"{name} wheel stands still at {signals.torques[side]:.0f} N·m"
        return None

    def forget(self) -> None:
        """Count from nothing again: a wheel that no stop lets move could not show that it has come free."""
        self._given = [0.0, 0.0]

    def _push(self, side: int, torque: float, elapsed: float) -> None:
        beyond = math.copysign(max(abs(torque) - HOLDING, 0.0), torque) if math.isfinite(torque) else 0.0
        self._given[side] += beyond * elapsed
