"""Pacing of simulated time to wall time, which never catches up."""

import math
import time
from collections.abc import Callable

from refseq_bench.sim.errors import SimError


class RealTimePacer:
    """Holds simulated time back to ``factor`` times wall time.

    Time lost, to drawing say, stays lost: a robot that caught up would be too quick to be led.
    """

    def __init__(
        self,
        factor: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not 0 < factor < math.inf:
            raise SimError(f"rate {factor:g} is not valid; it should be simulated over real time, above 0")
        self._factor, self._clock, self._sleep = factor, clock, sleep
        self._due = -math.inf
        self._last: float | None = None

    def keep(self, simulated: float) -> None:
        """Wait until it is time for ``simulated`` [s]; the first call waits for nothing: time counts from it on."""
        passed = 0.0 if self._last is None else (simulated - self._last) / self._factor
        self._last = simulated
        self._due = max(self._due + passed, self._clock())
        ahead = self._due - self._clock()
        if ahead > 0:
            self._sleep(ahead)
