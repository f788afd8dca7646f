"""Weights of places as a belief."""

import time
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Timings, belief_from


class Spent(Protocol):
    """Time spent on a view's features and on comparing them with the map [s]."""

    @property
    def features(self) -> float: ...  # noqa: D102

    @property
    def matching(self) -> float: ...  # noqa: D102


def answer(weights: NDArray[np.float64], lost: float, spent: Spent, since: float | None = None) -> Belief:
    """The belief in proportion to ``weights`` (K,); ``since`` is when filtering began (``time.perf_counter``)."""
    chain = 0.0 if since is None else time.perf_counter() - since
    timings = Timings(features=spent.features, matching=spent.matching, chain=chain)
    return belief_from(weights, min(max(lost, 0.0), 1.0), timings=timings)
