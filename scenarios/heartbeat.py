"""A sign of life every ten seconds, where no terminal shows things moving."""

import time
from collections.abc import Callable

from rich.console import Console

from refseq_bench.scenarios.tables import say

PERIOD = 10.0
"""Longest silence of what works [s]. A longer one is taken for a hang by who reads along, a shorter one fills logs."""


class Heartbeat:
    """Says how things stand whenever nothing was said for ``PERIOD`` seconds."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self._console, self._clock = console, clock
        self._last = clock()

    def say(self, line: str) -> None:
        """Say something that is news by itself."""
        self._last = self._clock()
        say(self._console, line)

    def beat(self, state: Callable[[], str]) -> None:
        """Say how things stand if it is time to; call it at least once a second."""
        if self._clock() - self._last >= PERIOD:
            self.say(state())
