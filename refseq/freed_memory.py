"""Memory that was freed and is kept by the process: pictures and what is made of them come and go, view after view.

The GNU C library gives large blocks back to the kernel when they are freed, and gets them anew, page by page and
cleared, for the next picture. That is a third of what SIFT takes on a picture of VGA size, and helps nobody.
"""

import ctypes
import os
import sys

LARGE, UNUSED = 32 * 2**20, 64 * 2**20
"""Blocks below so many bytes are kept when they are freed, the most that the library takes; as long as no more than so
many lie unused at the end."""
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
"""Parameters of ``mallopt``, in <malloc.h>."""
TOLD = "MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_", "GLIBC_TUNABLES"
"""Variables of the environment that tell the library otherwise."""


def keep_freed_memory() -> None:
    """Keep freed memory from now on, where the C library is GNU's and the environment says nothing of it."""
    if sys.platform != "linux" or any(name in os.environ for name in TOLD):
        return
    adjust = getattr(ctypes.CDLL(None), "mallopt", None)
    if adjust is not None:  # other C libraries have no such function
        adjust(MMAP_THRESHOLD, LARGE)
        adjust(TRIM_THRESHOLD, UNUSED)
