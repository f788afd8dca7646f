"""Where the time of a run goes."""

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray


class Stopwatch:
    """Splits the time of a run, of the clock and of the processor [s], by the innermost watched call that took it."""

    def __init__(self) -> None:
        self.spent = defaultdict[str, NDArray[np.float64]](lambda: np.zeros(2))
        self._running = ["other"]
        self._lap = _now()

    def _count(self) -> None:
        self.spent[self._running[-1]] += (now := _now()) - self._lap
        self._lap = now

    @contextmanager
    def counting(self, name: str) -> Iterator[None]:
        """Count for ``name`` what goes on inside."""
        self._count()
        self._running.append(name)
        try:
            yield
        finally:
            self._count()
            self._running.pop()

    def watch(self, patch: pytest.MonkeyPatch, owner: object, call: str, name: str) -> None:
        """Count the time of a call for ``name``."""
        watched = getattr(owner, call)

        def timed(*args: object, **kwargs: object) -> object:
            with self.counting(name):
                return watched(*args, **kwargs)

        patch.setattr(owner, call, timed)


def _now() -> NDArray[np.float64]:
    return np.array([time.perf_counter(), time.process_time()])
