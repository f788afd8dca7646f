"""Beliefs that are sure of their place: what the drive itself tells is remembered of such views alone."""

import numpy as np

from refseq.belief import Belief
from refseq.map.map import Map

SURE_LOST = 0.01
"""The chain is sure of a place where P(lost) is no more than this."""
SURE_NEAR = 0.9
"""And where so much of its belief is at the place and its two neighbours."""


def sure_place(map_: Map, belief: Belief) -> int | None:
    """The place that a belief is sure of, counted through all sequences; None where it is not."""
    if belief.lost > SURE_LOST:
        return None
    best = int(np.argmax(belief.places))
    around = np.arange(max(0, best - 1), min(best + 2, len(belief.places)))
    near = around[map_.in_a_row(around, best, 1)]
    return best if belief.places[map_.with_twins(near)].sum() >= SURE_NEAR else None
