"""The most memory that a process has had."""

import re
from pathlib import Path


def peak_megabytes() -> float:
    """Peak of this process's resident memory [MB], since its program began.

    Not ``getrusage``'s: that one a new program inherits from the process which started it.
    """
    told = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert told, "no peak in /proc/self/status"
    return int(told[1]) / 1e3
