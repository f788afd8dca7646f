"""Watch over a guest's memory, threads and scratch folder, which no limit of the kernel's holds as a whole."""

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

from refseq_bench.scenarios.methods.guests.limits import GuestLimits

PERIOD = 0.05
"""Time between two looks [s]: a process fills some 100 MB in it."""
MOST_FILES = 10_000
"""Files that a guest may have in its scratch folder; more would make each look long."""
PAGE = os.sysconf("SC_PAGE_SIZE")
BLOCK = 512
"""Unit of the blocks that a file takes up [bytes]."""


class Watch(Thread):
    """Ends a guest that takes more than it may; ``reason`` then says of what."""

    def __init__(self, pid: int, limits: GuestLimits, scratch: Path) -> None:
        super().__init__(name=f"watch over guest {pid}", daemon=True)
        self._pid, self._limits, self._scratch = pid, limits, scratch
        self._over = Event()
        self.reason, self.peak_bytes = "", 0

    def run(self) -> None:
        """Look again and again until it is stopped or the guest is gone."""
        while not self._over.wait(PERIOD):
            with suppress(FileNotFoundError, ProcessLookupError):  # a thread has ended meanwhile, or all have
                self.reason = self._excess()
            if self.reason:
                os.kill(self._pid, signal.SIGKILL)
                return

    def stop(self) -> None:
        """Look no more; must be called before the guest's number may become another's."""
        self._over.set()
        self.join()

    def _excess(self) -> str:
        limits, tasks = self._limits, Path("/proc") / str(self._pid) / "task"
        threads = list(tasks.iterdir())
        # Of a process whose first thread has ended only the others tell.
        resident = int((threads[-1] / "statm").read_text().split()[1]) * PAGE
        self.peak_bytes = max(self.peak_bytes, resident)
        if resident > limits.memory_bytes:
            return f"took more than {limits.memory:g} GiB of memory"
        if len(threads) > limits.threads:
            return f"began more than {limits.threads:g} threads"
        return self._excess_of_files()

    def _excess_of_files(self) -> str:
        taken = 0
        try:
            for number, size in enumerate(_sizes(self._scratch)):
                taken += size
                if taken > self._limits.scratch_bytes or number > MOST_FILES:
                    return f"wrote more than {self._limits.scratch:g} GiB or {MOST_FILES} files"
        except OSError as error:  # its folders are nested too deep to be looked into
            return f"hid what it wrote: {error.strerror}"
        return ""


def _sizes(folder: Path) -> Iterator[int]:
    """Space that each file and folder below one takes up [bytes]."""
    left = [str(folder)]
    while left:
        with suppress(FileNotFoundError), os.scandir(left.pop()) as entries:  # it may remove them meanwhile
            for entry in entries:
                with suppress(FileNotFoundError):
                    yield entry.stat(follow_symlinks=False).st_blocks * BLOCK
                if entry.is_dir(follow_symlinks=False):
                    left.append(entry.path)
