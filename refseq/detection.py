"""How features show up: each at its own places with some chance, and anywhere with another (docs/best.md).

A Bernoulli model of one extractor's features, whose rates are learnt from the reference drive itself. Feature i shows
up in a view at place k with probability f_i + d s_ik (1 − f_i): by *false alarm* with f_i, how common it is in the
drive; by *detection* with d s_ik, where s_ik is 1 at the places that showed it and falls off at the places beside them
as fast as neighbouring reference views lose each other's features. What light leaves of the detections, d, is not known
and is averaged over a few values, for every view anew.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.special import logsumexp

from refseq.columns import Rows

RATES = np.array([0.05, 0.2, 0.5, 0.9])
"""Detection rates that are averaged over."""
REACH = 3
"""Places to both sides that may share a place's features."""
PRIOR = 2.0
"""Feature i's false alarm rate is (n_i + 2) / (K + 4): seen twice and missed twice more (Agresti & Coull 1998)."""
LEAST = 0.01
"""Places that share less than this of a place's features are not worth keeping."""


class Detection:
    """The model of one extractor's features: log-likelihood ratios of places against anywhere else."""

    def __init__(self, rows: Rows) -> None:
        self._counts, self._K = np.diff(rows.pointers), rows.K
        self.fading = fading(rows)
        levels = spread(rows, int(np.count_nonzero(self.fading >= LEAST)))
        self._L = len(levels)
        # Column i · L + l holds the places that are l places away from the nearest one that showed feature i.
        column = np.concatenate([keys // rows.K * self._L + level for level, keys in enumerate(levels)])
        places = np.concatenate([keys % rows.K for keys in levels])
        order = np.argsort(column, kind="stable")
        self._places = places[order].astype(np.int32)
        self._pointers = np.concatenate([[0], np.cumsum(np.bincount(column, minlength=rows.n * self._L))])
        missed = np.log1p(-np.outer(RATES, self.fading[: self._L]))
        level = column % self._L
        self._all_missed = np.stack([np.bincount(places, row[level], minlength=rows.K) for row in missed])

    def log_ratios(self, ids: NDArray[np.intp], held_out: bool = False) -> NDArray[np.float64]:
        """Log P(view | place) / P(view | anywhere), (K,), of a view that shows the features ``ids``.

        With ``held_out`` the view is one of the reference's own and does not count as an example of what is common.
        Ratios at places farther than ``REACH`` from it are then what they were if it had not been learnt.
        """
        alarm = ((self._counts[ids] - held_out + PRIOR) / (self._K - held_out + 2 * PRIOR))[:, None, None]
        rate = self.fading[: self._L, None] * RATES
        gain = np.log1p(rate * (1 - alarm) / alarm) - np.log1p(-rate)  # (n, L, rates)
        begin, end = self._pointers[ids * self._L], self._pointers[(ids + 1) * self._L]
        lengths = np.diff(self._pointers)[(ids[:, None] * self._L + np.arange(self._L)).ravel()]
        entries = np.repeat(begin - np.concatenate([[0], np.cumsum(end - begin)[:-1]]), end - begin)
        places = self._places[entries + np.arange(len(entries))] if len(ids) else self._places[:0]
        pointers = np.concatenate([[0], np.cumsum(lengths)])
        at = csc_array((np.ones(len(places)), places, pointers), shape=(self._K, len(lengths)))
        by_rate = at @ gain.reshape(-1, len(RATES)) + self._all_missed.T
        mean: NDArray[np.float64] = logsumexp(by_rate, axis=1) - np.log(len(RATES))
        return mean


def pair_keys(rows: Rows) -> NDArray[np.int64]:
    """One number for each pair of feature i and place k, i · K + k, rising, (nnz,)."""
    return rows.numbers().astype(np.int64) * rows.K + rows.places


def fading(rows: Rows) -> NDArray[np.float64]:
    """How much of a place's features the places 0 to ``REACH`` away still show, (REACH + 1,), the first 1, falling.

    Shares that neighbours have in common by chance are taken off. What two views at the very same place have in common
    no drive tells; it is carried on from one and two places away, as for a share that falls by the same factor.
    """
    keys, counts, K = pair_keys(rows), np.diff(rows.pointers), rows.K
    pairs, chances = np.zeros(REACH), np.zeros(REACH)
    for away in range(1, REACH + 1):
        inside = keys[rows.places + away < K] + away
        found = np.minimum(np.searchsorted(keys, inside), max(len(keys) - 1, 0))
        pairs[away - 1] = np.count_nonzero(keys[found] == inside) if len(keys) else 0
        chances[away - 1] = max(len(inside), 1)
    far = (counts.astype(float) ** 2).sum() - counts.sum() - 2 * pairs.sum()
    by_chance = max(far, 0.0) / max(counts.sum() * (K - 2.0 * REACH - 1), 1.0)
    share = np.clip((pairs / chances - by_chance) / max(1 - by_chance, LEAST), 0.0, 1.0)
    same = min(1.0, max(share[0] ** 2 / share[1], share[0])) if share[1] > 0 else 1.0
    faded = share / same if same > 0 else np.zeros(REACH)
    return np.minimum.accumulate(np.concatenate([[1.0], faded]))


def spread(rows: Rows, levels: int) -> list[NDArray[np.int64]]:
    """Keys of the pairs that are 0, 1, … ``levels`` − 1 places away from one that was seen, each pair once."""
    spread_keys = [pair_keys(rows)]
    taken = spread_keys[0]
    for _ in range(1, levels):
        last = spread_keys[-1]
        place = last % rows.K
        beside = np.union1d(last[place > 0] - 1, last[place < rows.K - 1] + 1)
        spread_keys.append(np.setdiff1d(beside, taken, assume_unique=True))
        taken = np.union1d(taken, spread_keys[-1])
    return spread_keys
