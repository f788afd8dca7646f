"""Where the time of a run goes."""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import pytest
from numpy.typing import NDArray


class Stopwatch:
    """Splits the time of a run, of the clock and of the processor [s], by the innermost watched call that took it.

    Looking at the watch takes a microsecond, which counts for who looked.
    """

    def __init__(self) -> None:
        self._spent = defaultdict[str, list[float]](lambda: [0.0, 0.0])
        self._running = ["other"]
        self._lap = time.perf_counter(), time.process_time()

    @property
    def spent(self) -> Mapping[str, NDArray[np.float64]]:
        """Seconds of the clock and of the processor, (2,), by name; nothing of what did not run."""
        return defaultdict(lambda: np.zeros(2), {name: np.array(both) for name, both in self._spent.items()})

    def reset(self) -> None:
        """Forget what was spent so far."""
        self._spent.clear()

    def _count(self) -> None:
        clock, processor = time.perf_counter(), time.process_time()
        both = self._spent[self._running[-1]]
        both[0] += clock - self._lap[0]
        both[1] += processor - self._lap[1]
        self._lap = clock, processor

    @contextmanager
    def counting(self, name: str) -> Iterator[None]:
        """Count for ``name`` what goes on inside."""
        self._begin(name)
        try:
            yield
        finally:
            self._end()

    def watch(self, patch: pytest.MonkeyPatch, owner: object, call: str, name: str) -> None:
        """Count the time of a call for ``name``."""
        watched = getattr(owner, call)

        def timed(*args: object, **kwargs: object) -> object:
            self._begin(name)
            try:
                return watched(*args, **kwargs)
            finally:
                self._end()

        patch.setattr(owner, call, timed)

    def _begin(self, name: str) -> None:
        self._count()
        self._running.append(name)

    def _end(self) -> None:
        self._count()
        self._running.pop()
