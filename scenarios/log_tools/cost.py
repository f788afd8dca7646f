"""Memory and time that a log's views will take, timed on a few of them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from refseq.errors import RefseqError
from refseq.view import View

TIMED = 3
"""Views that are learnt to tell the time of all: fewer tell it worse, more let the user wait."""


@dataclass(frozen=True, slots=True)
class ExpectedCost:
    """Memory of the views' pictures and scans [bytes], and time to learn them on this machine [s]."""

    memory: int
    learning: float


def expected_cost(samples: Sequence[View], views: int, profile: str) -> ExpectedCost | None:
    """Learn a few ``samples`` and reckon from them for all ``views``; None without any, and where no map is to be.

    That is told by the verdicts, and keeps nobody from all else that is known of the log.
    """
    if not samples:
        return None
    from refseq.map.learning import learn  # slow to import: a log that cannot be read is told without it

    pair = samples if len(samples) > 1 else 2 * [*samples]  # one place alone is no way, and no map
    line = [replace(view, distance=1.0 if number else 0.0, turn=0.0) for number, view in enumerate(pair)]
    begin = time.perf_counter()
    try:
        learn(line, profile=profile)
    except RefseqError:
        return None
    seconds = (time.perf_counter() - begin) / len(line)
    size = sum(sum(image.nbytes for image in view.images.values()) + _scan_bytes(view) for view in line) / len(line)
    return ExpectedCost(round(size * views), seconds * views)


def _scan_bytes(view: View) -> int:
    return 0 if view.scan is None else view.scan.ranges.nbytes
