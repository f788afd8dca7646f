"""Light thrown to and fro between surfaces: how long it is followed."""

import numpy as np

from refseq_bench.worlds.arrays import Floats

SETTLED, MOST = 1e-5, 1000
"""Light stands when no place's changes by more than this share of the brightest one's, or after so many reflections:
only walls that take in nothing come so far."""


def settled(before: Floats, after: Floats) -> bool:
    """Tell whether one more reflection changes next to nothing, for the light of the same places before and after."""
    return bool(np.abs(after - before).max(initial=0.0) <= SETTLED * after.max(initial=0.0))
