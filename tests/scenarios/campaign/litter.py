"""What leaves memory in pieces, for processes that import nothing else."""

import os
from pathlib import Path

PINNED: list[bytes] = []


def litter() -> None:
    """Take 200 MB in pieces, and leave the last one in the way of what would be given back by itself."""
    pieces = [bytes([number % 256]) * 20_000 for number in range(10_000)]
    PINNED.append(pieces[-1])


def resident() -> int:
    """Memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
