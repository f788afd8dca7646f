"""Rank agreement of methods' scores on two kinds of cases, such as real recordings and their simulated twins.

Spearman's ρ compares ranks; Kendall's τ-b counts pairs of methods in the same and in opposite order, allowing for ties
(M. G. Kendall, Rank Correlation Methods, 1948). Methods are few and not independent: stages of one profile resemble
each other. The interval draws methods anew, and runs within each case, with replacement.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.scoring.intervals.bootstrap import COVERED, SEED

DRAWS = 2000
"""Resamples of an interval: fewer make its ends tremble, more take longer."""
FEWEST = 3
"""Different methods below which there is no order to speak of."""

Scores = NDArray[np.float64]
"""Scores of a case: a row a method, a column a run, (M, R)."""


@dataclass(frozen=True, slots=True)
class RankCorrelation:
    """A rank correlation and its 95 % interval; nan where all methods of a side score alike."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class RankAgreement:
    """Agreement of two orders of methods: both correlations, and how many ``pairs`` of methods stand ``alike``.

    Pairs that a side holds for equal are not counted.
    """

    spearman: RankCorrelation
    kendall: RankCorrelation
    alike: int
    pairs: int


@dataclass(frozen=True, slots=True)
class ChangedPair:
    """Two methods, by their rows, that change places: the ``better`` leads by so much, and lags on the second side."""

    better: int
    worse: int
    lead: float
    lag: float


def mean_scores(cases: Sequence[Scores]) -> Scores:
    """Mean score of each method over cases, each the mean of its runs, (M,)."""
    return np.mean([case.mean(axis=1) for case in cases], axis=0)


def rank_agreement(first: Sequence[Scores], second: Sequence[Scores]) -> RankAgreement:
    """Compare the mean scores of the same methods over two groups of cases; all cases have the same M rows."""
    ours, others = mean_scores(first), mean_scores(second)
    drawn = _correlations(*_resampled(first, second)) if len(ours) >= FEWEST else np.full((2, 1), math.nan)
    low, high = (_quantile(drawn, share) for share in ((1 - COVERED) / 2, (1 + COVERED) / 2))
    spearman, kendall = (RankCorrelation(*three) for three in zip(correlations(ours, others), low, high, strict=True))
    order = _signs(ours) * _signs(others)
    return RankAgreement(spearman, kendall, int(np.sum(order > 0)), int(np.sum(order != 0)))


def correlations(ours: Scores, others: Scores) -> tuple[float, float]:
    """Spearman's ρ and Kendall's τ-b of scores (M,); nan where there is no order."""
    if len(ours) < FEWEST or np.ptp(ours) == 0 or np.ptp(others) == 0:
        return math.nan, math.nan
    from scipy.stats import (  # half a second to import, which no mistake in a folder's name waits for
        kendalltau,
        spearmanr,
    )

    return float(spearmanr(ours, others).statistic), float(kendalltau(ours, others).statistic)


def changed_pairs(ours: Scores, others: Scores) -> list[ChangedPair]:
    """Pairs of methods whose order differs between scores (M,), those first that differ clearly on both sides."""
    count = len(ours)
    ways = ((a, b) for a in range(count) for b in range(count) if ours[a] > ours[b] and others[a] < others[b])
    found = [ChangedPair(a, b, float(ours[a] - ours[b]), float(others[b] - others[a])) for a, b in ways]
    return sorted(found, key=lambda pair: -min(pair.lead, pair.lag))


def _resampled(first: Sequence[Scores], second: Sequence[Scores]) -> tuple[Scores, Scores]:
    """Mean scores of both sides in resamples of methods and of runs, (DRAWS, M) each."""
    rng = np.random.default_rng(SEED)
    rows = rng.integers(len(first[0]), size=(DRAWS, len(first[0])))
    ours, others = (
        np.mean([case[:, rng.integers(case.shape[1], size=(DRAWS, case.shape[1]))].mean(axis=2) for case in cases], 0)
        for cases in (first, second)
    )  # (M, DRAWS)
    return np.take_along_axis(ours.T, rows, axis=1), np.take_along_axis(others.T, rows, axis=1)


def _correlations(ours: Scores, others: Scores) -> Scores:
    """ρ and τ-b of many resamples (n, M) at once, (2, n): what SciPy reckons for one, hundreds of times as quickly."""
    with np.errstate(invalid="ignore"):  # 0 / 0 where all score alike: nan
        return np.array([_cosines(*map(_centred_ranks, (ours, others))), _cosines(*map(_signs, (ours, others)))])


def _centred_ranks(scores: Scores) -> Scores:
    from scipy.stats import rankdata  # as above

    return rankdata(scores, axis=-1) - (scores.shape[-1] + 1) / 2


def _cosines(first: NDArray[np.float64], second: NDArray[np.float64]) -> Scores:
    """Cosines between rows."""
    across = (np.sum(one * other, axis=-1) for one, other in ((first, second), (first, first), (second, second)))
    product, own, others = across
    return product / np.sqrt(own * others)


def _quantile(drawn: Scores, share: float) -> list[float]:
    """A quantile of both correlations over resamples that have one, nan where none has."""
    known = (row[~np.isnan(row)] for row in drawn)
    return [float(np.quantile(row, share)) if len(row) else math.nan for row in known]


def _signs(scores: Scores) -> Scores:
    """Order of each two scores of a row: 1, 0 or -1, (..., M (M - 1) / 2)."""
    rows, columns = np.triu_indices(scores.shape[-1], 1)
    return np.sign(scores[..., rows] - scores[..., columns])
