"""Initialise a worker's process: few threads, so that workers do not fight for cores, no memory that nothing needs.

It dies with its master. This runs first in a new process: nothing is imported here that counts threads when it is
loaded.
"""

import ctypes
import gc
import os
import time
from collections.abc import Callable
from threading import Thread
from typing import TypeVar

T = TypeVar("T")
LOOK = 1.0
"""Period in which a worker looks whether its master lives [s]."""
BLAS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Sums that are split among threads are rounded otherwise: one thread, so that answers do not depend on the cores."""
RENDERING = "LP_NUM_THREADS"
"""Threads of Mesa's software drivers; pictures are the same with any number."""


def init_worker(master: int, threads: int) -> None:
    """Begin a worker of the process ``master``, which may draw and filter images with so many threads."""
    os.environ.update(dict.fromkeys(BLAS, "1"))
    os.environ.setdefault(RENDERING, str(threads))
    Thread(target=_follow, args=(master,), daemon=True).start()
    import cv2

    cv2.setNumThreads(threads)


def _follow(master: int) -> None:
    """End the process when its master is gone, however it went: nobody waits for the work any more."""
    while os.getppid() == master:
        time.sleep(LOOK)
    os._exit(1)


def call_and_trim(function: Callable[..., T], *given: object) -> T:
    """Call a function, then give memory that nothing holds any more back to the system.

    glibc keeps what it has once had, in pieces: after a dozen drives with images that was more than half a gigabyte.
    """
    try:
        return function(*given)
    finally:
        gc.collect()
        if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
            trim(0)


def share(workers: int) -> int:
    """Threads for each of so many workers on this machine."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // workers)
