"""Initialise a worker's process: few threads, so that workers do not fight for cores, no memory that nothing needs.

It dies with its master. This runs first in a new process: nothing is imported here that counts threads when it is
loaded.
"""

import gc
import os
from collections.abc import Callable
from typing import TypeVar

from refseq.children import follow_parent
from refseq.freed_memory import give_back_freed_memory, keep_freed_memory
from refseq.threads import ONE_THREAD

T = TypeVar("T")
RENDERING = "LP_NUM_THREADS"
"""Threads of Mesa's software drivers; pictures are the same with any number."""


def init_worker(master: int, threads: int) -> None:
    """Begin a worker of the process ``master``, which may draw and filter images with so many threads."""
    os.environ.update(ONE_THREAD)
    os.environ.setdefault(RENDERING, str(threads))
    keep_freed_memory()
    follow_parent(master)
    import cv2

    cv2.setNumThreads(threads)


def call_and_trim(function: Callable[..., T], *given: object) -> T:
    """Call a function, then give memory that nothing holds any more back to the system.

    glibc keeps what it has once had, in pieces: after a dozen drives with images that was more than half a gigabyte.
    """
    try:
        return function(*given)
    finally:
        gc.collect()
        give_back_freed_memory()


def share(workers: int) -> int:
    """Threads for each of so many workers on this machine."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // workers)
