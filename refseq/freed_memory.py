"""Memory that was freed: kept by the process for what comes next, or given back to the system.

The GNU C library gives large blocks back to the kernel when they are freed, and gets them anew, page by page and
cleared. Pictures and what is made of them come and go view after view: that is a third of what SIFT takes on a picture
of VGA size, and helps nobody.
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
    if not any(name in os.environ for name in TOLD):
        _call("mallopt", MMAP_THRESHOLD, LARGE)
        _call("mallopt", TRIM_THRESHOLD, UNUSED)


def give_back_freed_memory() -> None:
    """Give all that nothing holds any more back to the system, once, where the C library is GNU's."""
    _call("malloc_trim", 0)


def _call(name: str, *numbers: int) -> None:
    """Call a function of the C library, which only GNU's has."""
    if sys.platform == "linux" and (function := getattr(ctypes.CDLL(None), name, None)):
        function(*numbers)
