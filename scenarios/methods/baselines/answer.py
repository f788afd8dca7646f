"""Weights of places as a belief."""

import time

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Timings, belief_from
from scenarios.methods.baselines.vlad import Likeness


def answer(weights: NDArray[np.float64], lost: float, likeness: Likeness, since: float | None = None) -> Belief:
    """The belief in proportion to ``weights`` (K,); ``since`` is when filtering began (``time.perf_counter``)."""
    spent = 0.0 if since is None else time.perf_counter() - since
    timings = Timings(features=likeness.features, matching=likeness.matching, chain=spent)
    return belief_from(weights, min(max(lost, 0.0), 1.0), timings=timings)
