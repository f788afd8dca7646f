"""Things that happen to a command on its way: a kill, a disk that is full, a second command, a clock that goes back.

Each is called in the command's own process before it begins; ``worker`` names them as ``arms``.
"""

import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate", "sqlite3.connect", "shutil.rmtree")
"""Audit events that change what lies on the disk, besides opening a file to write."""


def unharmed() -> None:
    """Nothing happens."""


def kill_after(seconds: float) -> None:
    """Kill this process when so much time has passed, whatever it does then."""
    own = os.pidfd_open(os.getpid())
    if not os.fork():
        time.sleep(seconds)
        signal.pidfd_send_signal(own, signal.SIGKILL)
        os._exit(0)


def kill_before_change(number: int) -> None:
    """Kill this process just before its ``number``-th change of a file or folder, or view that is written."""
    left = [number]

    def count() -> None:
        left[0] -= 1
        if not left[0]:
            os.kill(os.getpid(), signal.SIGKILL)

    _at_each_change(count)


def count_changes(file: str) -> None:
    """Leave the number of changes in a file, a byte for each."""
    counted = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    _at_each_change(lambda: os.write(counted, b"."))


def _at_each_change(told: Callable[[], object]) -> None:
    busy = [False]

    def hear(event: str, given: tuple[Any, ...]) -> None:
        opened = event == "open" and isinstance(given[2], int) and given[2] & (os.O_WRONLY | os.O_RDWR)
        if not busy[0] and (opened or event in CHANGES):
            busy[0] = True
            told()
            busy[0] = False

    sys.addaudithook(hear)
    _before_each_view(told)


def _before_each_view(told: Callable[[], object]) -> None:
    from refseq.logs.foxglove.writer import RecordingWriter
    from refseq.logs.ros.writer import BagWriter

    for writer in (RecordingWriter, BagWriter):
        _wrap(writer, told, lambda: None)


def count_views(file: str) -> None:
    """Leave the number of views that were written in a file, a byte for each."""
    counted = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    from refseq.logs.foxglove.writer import RecordingWriter
    from refseq.logs.ros.writer import BagWriter

    for writer in (RecordingWriter, BagWriter):
        _wrap(writer, lambda: None, lambda: os.write(counted, b"."))


def _wrap(writer: Any, before: Callable[[], object], after: Callable[[], object]) -> None:
    write = writer.write

    @wraps(write)
    def told(*given: object) -> None:
        before()
        write(*given)
        after()

    writer.write = told


def full_disk(size: int) -> None:
    """Let no file grow beyond ``size`` [bytes]."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def interrupt_after(seconds: float) -> None:
    """Send this process SIGTERM when so much time has passed."""
    own = os.pidfd_open(os.getpid())
    if not os.fork():
        time.sleep(seconds)
        signal.pidfd_send_signal(own, signal.SIGTERM)
        os._exit(0)


def beside(words: Sequence[str]) -> None:
    """Run another command at the same time; both have to end well."""
    children = []
    for own in (sys.argv, ["refseq", *words]):
        child = os.fork()
        if not child:
            sys.argv = list(own)
            return
        children.append(child)
    codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    os._exit(next((abs(code) for code in codes if code), 0))


def clock_back(seconds: float, after: int) -> None:
    """Set the clock back when it has been looked at ``after`` times, and let what lies here come from the future."""
    looks = [0]
    now, now_ns = time.time, time.time_ns

    def moved() -> float:
        looks[0] += 1
        return seconds if looks[0] > after else 0.0

    time.time = lambda: now() - moved()
    time.time_ns = lambda: now_ns() - int(moved() * 1e9)
    for path in Path().rglob("*"):
        os.utime(path, (now() + seconds, now() + seconds))


def in_one_process() -> None:
    """Let a campaign's tasks be done in this process, so that what happens to it happens in the midst of them."""
    from refseq_bench.scenarios.campaign.run import workers
    from refseq_bench.scenarios.campaign.store.cache import Store
    from tests.robustness.fingerprints import Here

    workers.LocalWorkers = lambda count, folder: Here(Store(folder))  # type: ignore[assignment, misc]


Arms = Mapping[str, Mapping[str, object]]
"""Functions of this module by name, and what they are given."""
