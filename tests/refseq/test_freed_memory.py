"""Freed memory that stays, told by what the kernel hands out to a process of its own."""

import ctypes
import os
import subprocess
import sys

import pytest

from refseq.freed_memory import TOLD

PAGES, ROUNDS = 2000, 50
ASK = f"""
import resource
import sys
import numpy as np
from refseq.freed_memory import keep_freed_memory
if sys.argv[1] == "kept":
    keep_freed_memory()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range({ROUNDS}):
    pictures = [np.ones({PAGES} // 4 * 4096, np.uint8) for _ in range(4)]
    del pictures
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def pages_taken(how: str, told: dict[str, str]) -> int:
    environment = {name: value for name, value in os.environ.items() if name not in TOLD} | told
    found = subprocess.run(
        [sys.executable, "-c", ASK, how], env=environment, capture_output=True, text=True, check=True
    )
    return int(found.stdout)


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallopt"), reason="the C library is not GNU's"
)
def test_what_was_freed_is_used_again_unless_the_environment_says_otherwise() -> None:
    """Four blocks of 2 MB, again and again: their pages come from the kernel once, or each time."""
    assert pages_taken("kept", {}) < 2 * PAGES
    assert pages_taken("kept", {"MALLOC_TRIM_THRESHOLD_": "131072"}) > ROUNDS * PAGES / 2
    assert pages_taken("left", {}) > ROUNDS * PAGES / 2
