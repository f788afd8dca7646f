"""Paired comparison of two methods over seeds, and Holm's correction of many.

Both methods answer the same views of the same seeds, so that only the differences between them count, one a seed. They
are tested by the wild bootstrap with the null imposed: each difference is multiplied by a random weight of mean 0, and
the t statistic of what results is compared with the one found (C. F. J. Liu, Annals of Statistics 16, 1988). With the
six weights of M. D. Webb (Canadian J. Economics 56, 2023), made for few clusters, n seeds have 6^n resamples and the
least p-value is 6^(1−n): three seeds show one comparison at 5 % at most, four 10, five 64. A bootstrap that draws seeds
anew knows much less of so few: for five differences of 29 to 32 points it finds p = 0.011, this one 0.0008.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.scoring.intervals.bootstrap import COVERED, SEED

LEVEL = 1 - COVERED
"""Chance of being wrong that a comparison, or with Holm's correction all of a campaign, may have."""
WEIGHTS = np.sqrt([0.5, 1.0, 1.5])
"""Webb's weights, each with either sign."""
MOST_EXACT = 5
"""Seeds up to which every resample is looked at, 7776 of them."""
DRAWS = 20_000
"""Resamples of more seeds than that, drawn with the seed of all bootstraps."""


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """Mean ``difference`` of two methods' shares over seeds, and its two-sided ``p``-value.

    ``smallest`` is the least mean difference that seeds of this spread could show, be it a lead or a lag, infinite
    where they could show none.
    """

    difference: float
    p: float
    smallest: float


@cache  # a campaign's index is written anew after each case; no bound holds all comparisons of the largest one
def paired_difference(ours: tuple[float, ...], others: tuple[float, ...], floor: float = 0.0) -> PairedDifference:
    """Compare two methods by their shares, an entry a seed, two at least.

    ``floor`` is the least difference that there can be, such as one view a seed: it is what could be shown where the
    methods differ by the same amount at all seeds.
    """
    apart = np.subtract(ours, others).astype(np.float64)
    p = _Resamples(apart).p_value(0.0)
    return PairedDifference(float(apart.mean()), p, max(floor, _smallest(apart - apart.mean())))


class _Resamples:
    """Resamples of differences (n,) as sums over seeds (B,), of which those of all shifted by any amount are made."""

    def __init__(self, apart: NDArray[np.float64]) -> None:
        weights = _weights(len(apart))
        drawn = weights * apart
        self._apart, self._mean, self._weight = apart, drawn.mean(axis=1), weights.mean(axis=1)
        drawn -= self._mean[:, None]
        rest = weights - self._weight[:, None]
        self._squares = [np.einsum("bn,bn->b", *pair) for pair in ((drawn, drawn), (drawn, rest), (rest, rest))]

    def p_value(self, shift: float) -> float:
        """Two-sided p-value of the differences, all larger by ``shift``, having mean 0."""
        count, (own, both, weight) = len(self._apart), self._squares
        spread = np.sqrt(np.maximum(own + shift * (2 * both + shift * weight), 0.0) / (count - 1))
        found = _t((self._apart + shift).mean(), self._apart.std(ddof=1))
        return max(float(np.mean(_t(self._mean + shift * self._weight, spread) >= found * (1 - 1e-9))), least_p(count))


def _smallest(centred: NDArray[np.float64]) -> float:
    """The least size of a mean that residuals (n,) would let show with either sign.

    By halving the interval in which p falls below the level. Residuals to one side only let a lead be shown sooner than
    a lag, or the other way about; whoever plans a campaign knows neither.
    """
    if least_p(len(centred)) > LEVEL:
        return math.inf
    resamples = _Resamples(centred)
    low, high = 0.0, 100 * float(np.ptp(centred))
    while high - low > 1e-4:
        middle = (low + high) / 2
        shown = all(resamples.p_value(mean) <= LEVEL for mean in (middle, -middle))
        low, high = (low, middle) if shown else (middle, high)
    return high


def _t(mean: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """The absolute t statistic but for √n; infinite of a mean without spread, 0 of no difference at all."""
    mean, flat = np.abs(mean), spread < 1e-12
    return np.where(flat, np.where(mean > 1e-12, np.inf, 0.0), mean / np.where(flat, 1.0, spread))


@cache
def _weights(count: int) -> NDArray[np.float64]:
    """Weights of all resamples, (B, count), or of some at random."""
    weights = np.concatenate([-WEIGHTS, WEIGHTS])
    if count <= MOST_EXACT:
        return weights[np.indices((len(weights),) * count).reshape(count, -1).T]
    return np.random.default_rng(SEED).choice(weights, size=(DRAWS, count))


def least_p(seeds: int) -> float:
    """Least p-value that so many seeds can give."""
    return max(6.0 ** (1 - seeds), 1 / DRAWS)


def comparisons_shown(seeds: int) -> int:
    """Number of comparisons of which so many seeds can still show one, after Holm's correction."""
    return math.floor(LEVEL / least_p(seeds) + 1e-9)


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values corrected for their number, in the same order (S. Holm, Scand. J. Statistics 6, 1979).

    The k-th smallest of m is multiplied by m − k + 1, and none is below a smaller one.
    """
    order = np.argsort(p_values, kind="stable")
    factors = np.arange(len(p_values), 0, -1)
    raised = np.maximum.accumulate(np.asarray(p_values, dtype=np.float64)[order] * factors)
    corrected = np.empty(len(p_values))
    corrected[order] = np.minimum(raised, 1.0)
    return [float(p) for p in corrected]
