"""Growth of this process's memory while something is done again and again."""

import gc
import resource
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from refseq.freed_memory import give_back_freed_memory

EVERY = 250
"""Steps between two looks at the memory: fewer would take time, more would leave few points for the fit."""
WARM_UP = 0.3
"""Share of the steps that is not looked at: caches fill, and libraries take what they keep."""


def resident() -> float:
    """Memory that this process holds [MB], after what nobody uses was given back."""
    gc.collect()
    give_back_freed_memory()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def growth(steps: Iterable[object], count: int) -> float:
    """Slope of the memory over ``count`` steps [MB a 1000 steps], after a warm-up; each step is one item."""
    looks = []
    for number, _ in enumerate(steps):
        if number >= WARM_UP * count and number % EVERY == 0:
            looks.append((number / 1000, resident()))
    at, held = np.array(looks).T
    return float(np.polyfit(at, held, 1)[0])
