"""Intervals over seeds: how a figure would vary had other drives been driven.

Views of one drive are alike: what goes wrong at a place goes wrong in the next ten views too. An interval that takes
each view as a trial of its own (Wilson's) is then too narrow. Here whole runs are drawn anew with replacement (the
cluster bootstrap: B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, chapters 8 and 13). Of few runs
even that is narrow: five runs that agree have no width at all.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement

import numpy as np

from refseq_bench.scenarios.scoring.proportion import Proportion

MOST_EXACT = 6
"""Runs up to which every resample is looked at, 462 of them, each as often as it would be drawn."""
DRAWS = 1000
"""Resamples of more runs than that, drawn with ``SEED``, so that the same runs have the same interval."""
SEED = 2008
COVERED = 0.95


def interval_over_runs(runs: Sequence[Proportion]) -> tuple[float, float] | None:
    """The middle 95 % of the pooled share over resamples of some runs; ``None`` for less than two, or without trials.

    Resamples without any trial do not count.
    """
    if len(runs) < 2:
        return None
    found = [(Proportion.pooled(runs[k] for k in chosen).value, weight) for chosen, weight in resamples(len(runs))]
    there = [(value, weight) for value, weight in found if not math.isnan(value)]
    return middle(there) if there else None


def middle(weighted: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """The middle 95 % of values with weights, one at least: from where to where they go."""
    values, weights = (np.array(column) for column in zip(*sorted(weighted), strict=True))
    # The smallest value that at least such a share of the resamples does not exceed; a hair for rounding.
    shares = np.cumsum(weights) / weights.sum()
    low, high = (int(np.searchsorted(shares, share - 1e-12)) for share in ((1 - COVERED) / 2, (1 + COVERED) / 2))
    return float(values[low]), float(values[min(high, len(values) - 1)])


def resamples(count: int) -> Iterator[tuple[tuple[int, ...], float]]:
    """Draws of ``count`` runs of as many, with replacement, and how probable each is; all, or some at random."""
    if count <= MOST_EXACT:
        for chosen in combinations_with_replacement(range(count), count):
            orders = math.factorial(count)
            for k in range(count):
                orders //= math.factorial(chosen.count(k))
            yield chosen, orders / count**count
        return
    rng = np.random.default_rng(SEED)
    for _ in range(DRAWS):
        yield tuple(int(k) for k in rng.integers(count, size=count)), 1 / DRAWS
