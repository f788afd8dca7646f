"""The most memory that a process has had."""

import re
from pathlib import Path


def peak_bytes() -> int:
    """Peak of this process's resident memory, since its program began.

    Not ``getrusage``'s: that one a new program inherits from the process which started it.
    """
    told = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert told, "no peak in /proc/self/status"
    return 1024 * int(told[1])
