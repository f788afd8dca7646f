"""Detection model of features: each seen at its own places with one rate, and anywhere with another (docs/best.md).

A Bernoulli model of one extractor's features, whose rates are learnt from the reference drive itself. Feature i shows
up in a view at place k with probability f_i + d s_ik (1 − f_i): by *false alarm* with f_i, how common it is in the
drive; by *detection* with d s_ik, where s_ik is 1 at the places that showed it and falls off at the places beside them
as fast as neighbouring reference views lose each other's features, and ends at a gap. What light leaves of the
detections, d, is not known and is averaged over a few values, for every view anew.

Beside the rows themselves a few numbers a place are kept, and one byte an entry: how far it is the nearest one of its
row, so that what lies beside a row's places need not be looked for at every view.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.sparse import csc_array

from refseq.inference.matching.columns import Rows, selected
from refseq.inference.matching.neighbours import REACH, Neighbours

RATES = np.array([0.05, 0.2, 0.5, 0.9])
"""Detection rates that are averaged over."""
PRIOR = 1.0
"""Feature i's false alarm rate is (n_i + 1) / (K + 2): seen once and missed once more (Laplace's rule)."""
LEAST = 0.01
"""Places that share less than this of a place's features are not worth keeping."""
PIECE = 1_000_000
"""Entries of the rows that are looked at in one go."""
FEW = 4000
"""Entries of the rows from which a sparse matrix of them pays; by measurement."""
SIDE = 4
"""Bits of a byte for how far an entry reaches ahead; the others are for how far behind."""


class Detection:
    """The model of one extractor's features: log-likelihood ratios of places against anywhere else.

    ``neighbours`` tell which places lie beside each other; by their numbers all that follow each other do.
    """

    def __init__(self, rows: Rows, neighbours: Neighbours | None = None) -> None:
        neighbours = neighbours or Neighbours.even(rows.K)
        self._rows, self._counts, self._K = rows, np.diff(rows.pointers), rows.K
        self.covisibility = covisibility(rows, neighbours)
        self._L = int(np.count_nonzero(self.covisibility >= LEAST))
        reaches, detectable = [np.zeros(0, np.uint8)], np.zeros((self._L, rows.K))
        for piece in rows.pieces(PIECE):
            reaches.append(reach(piece, self._L, neighbours))
            for level, beside in spread(piece, reaches[-1], self._L):
                detectable[level] += np.bincount(beside.places, minlength=rows.K)
        self._reach = np.concatenate(reaches)
        self._all_missed = detectable.T @ np.log1p(-np.outer(self.covisibility[: self._L], RATES))  # (K, rates)

    def log_ratios(
        self, ids: NDArray[np.intp], held_out: bool = False, places: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """Log P(view | place) / P(view | anywhere), (K,) or of ``places``, of a view that shows the features ``ids``.

        Ratios of some places, named once each, are those of all to the last bit, in less time the fewer they are.
        With ``held_out`` the view is one of the reference's own and does not count as an example of what is common.
        Ratios at places farther than ``REACH`` from it are then those of a drive without it, but for ``covisibility``,
        which stays the whole drive's.
        """
        false_alarm_rate = ((self._counts[ids] - held_out + PRIOR) / (self._K - held_out + 2 * PRIOR))[:, None]
        rate = self.covisibility[: self._L, None, None] * RATES
        gain = np.log1p(rate * (1 - false_alarm_rate) / false_alarm_rate) - np.log1p(-rate)  # (L, n, rates)
        rows, reaching = self._rows.select(ids), selected(self._rows.pointers, self._reach, ids)
        by_rate = self._all_missed.copy() if places is None else self._all_missed[places]
        for level, beside in _spread_to(rows, reaching, self._L, places):
            if len(beside.places):
                by_rate += _summed(beside, gain[level])
        return _log_mean(by_rate)


def _summed(rows: Rows, gain: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums over the rows at each place of what a row brings, (n, rates) to (K, rates), row after row."""
    if len(rows.places) < FEW:
        # To make a sparse matrix would take longer than to add; both add up in the same order.
        rates = gain.shape[1]
        at = rows.places[:, None] * np.intp(rates) + np.arange(rates)
        brought = np.take(gain, rows.numbers(), axis=0)
        return np.asarray(np.bincount(at.ravel(), brought.ravel(), rows.K * rates).reshape(rows.K, rates), np.float64)
    # Of pointers of 32 bits, as the places are, SciPy need not look at each entry.
    packed = np.ones(len(rows.places)), rows.places, rows.pointers.astype(np.int32)
    return np.asarray(csc_array(packed, shape=(rows.K, rows.n)) @ gain)


def _log_mean(logs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithm of the mean over the rates, (K, rates) to (K,)."""
    by_rate = np.ascontiguousarray(logs.T)  # sums along places are much faster
    top = by_rate.max(axis=0)
    mean: NDArray[np.float64] = top + np.log(np.exp(by_rate - top).mean(axis=0))
    return mean


def covisibility(rows: Rows, neighbours: Neighbours | None = None) -> NDArray[np.float64]:
    """Share of a place's features that places 0 to ``REACH`` steps away still show, (REACH + 1,), the first 1, falling.

    Shares that neighbours have in common by chance, as places farther apart have, are taken off. Where no more than
    that is left, neighbours share nothing: a ratio of two such rests would be any number. What two views at the very
    same place have in common no drive tells; it is carried on from one and two places away, as for a share that falls
    by the same factor.
    """
    found = _pairs(rows, neighbours or Neighbours.even(rows.K))
    chances = np.maximum(found.chances, 1.0)
    *near, by_chance = found.shared / chances
    excess = np.array(near) - by_chance
    share = np.clip(excess / max(1 - by_chance, LEAST), 0.0, 1.0)
    standard_error = np.sqrt(by_chance * (1 - by_chance) / chances[0])
    if excess[0] <= 2 * standard_error or share[0] < LEAST:
        return np.append(1.0, np.zeros(REACH))
    same = min(1.0, max(share[0] ** 2 / share[1], share[0])) if share[1] > 0 else 1.0
    return np.minimum.accumulate(np.concatenate([[1.0], share / same]))


class _Pairs(NamedTuple):
    """Pairs of a place that shows a feature with one that is 1 to ``REACH`` steps on, and, the last, farther off.

    ``shared`` (REACH + 1,) is in how many the other shows it too, of so many ``chances``. Pairs afar count both ways.
    """

    shared: NDArray[np.float64]
    chances: NDArray[np.float64]


def _pairs(rows: Rows, neighbours: Neighbours) -> _Pairs:
    """Count pairs over all rows; places of a stand are one, which shows a feature to the share of its views."""
    views = neighbours.views
    around = sliding_window_view(np.pad(views > 0, REACH), 2 * REACH + 1)  # (steps, from REACH behind to REACH ahead)
    possible = np.vstack([around[:, REACH + 1 :].T, np.count_nonzero(views) - around.sum(axis=1)])
    shared, chances = np.zeros(REACH + 1), np.zeros(REACH + 1)
    for piece in rows.pieces(PIECE):
        laid, share = _shown(piece, neighbours.step, views)
        row, step = np.divmod(laid, len(views) + REACH)
        apart = pairs_apart(laid, share)
        both_ways = float(np.square(np.bincount(row, share)).sum() - np.square(share).sum())
        shared += np.append(apart, both_ways - 2 * apart.sum())
        chances += possible @ np.bincount(step, share, len(views))
    return _Pairs(shared, chances)


def _shown(rows: Rows, step: NDArray[np.intp], views: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Row and step as one number (n,), rising, rows farther apart than ``REACH``; the share of views that show it."""
    each = rows.numbers() * (len(views) + REACH) + step[rows.places]
    begins = np.flatnonzero(np.append(True, each[1:] > each[:-1])[: len(each)])
    laid = each[begins]
    return laid, np.diff(np.append(begins, len(each))) / views[laid % (len(views) + REACH)]


def pairs_apart(laid: NDArray[np.intp], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Number of pairs, by their shares, of ``laid`` numbers (n,) that are 1, 2, … ``REACH`` apart, (REACH,)."""
    pairs = np.zeros(REACH)
    for step in range(1, REACH + 1):  # numbers are distinct: two that are 3 apart have at most 2 between them
        apart = laid[step:] - laid[:-step]
        near = apart <= REACH
        pairs += np.bincount(apart[near], (share[step:] * share[:-step])[near], minlength=REACH + 1)[1:]
    return pairs


def reach(rows: Rows, levels: int, neighbours: Neighbours) -> NDArray[np.uint8]:
    """Places ahead of and behind each entry that it is the nearest one of its row to, up to ``levels`` − 1, (nnz,).

    The lowest ``SIDE`` bits are for ahead. A place amid two of its row's is the earlier one's. No entry reaches over a
    gap.
    """
    none = np.int32(2 * rows.K)
    gap = np.full(len(rows.places) + 1, none)  # from the place before; there is none before a row's first
    np.subtract(rows.places[1:], rows.places[:-1], out=gap[1:-1])
    first, last = neighbours.first[rows.places], neighbours.last[rows.places]
    gap[:-1][np.append(True, first[1:] != first[:-1])[: len(first)]] = none  # one beyond a gap takes no place from it
    gap[rows.pointers] = none
    ahead = np.minimum(np.minimum(gap[1:] // 2, last - rows.places), levels - 1)
    behind = np.minimum(np.minimum((gap[:-1] - 1) // 2, rows.places - first), levels - 1)
    both: NDArray[np.uint8] = (ahead | behind << SIDE).astype(np.uint8)
    return both


def spread(rows: Rows, reaching: NDArray[np.uint8], levels: int) -> Iterator[tuple[int, Rows]]:
    """The places that are 0, 1, … ``levels`` − 1 away from the nearest one of their row, each once, with that level.

    ``reaching`` (nnz,) is the ``reach`` of the rows. There are several such pieces a level.
    """
    yield 0, rows
    if levels < 2:
        return
    ahead, behind = reaching & (1 << SIDE) - 1, reaching >> SIDE
    for level in range(1, levels):
        yield level, _moved(rows, np.flatnonzero(ahead >= level), level)
        yield level, _moved(rows, np.flatnonzero(behind >= level), -level)


def _spread_to(
    rows: Rows, reaching: NDArray[np.uint8], levels: int, places: NDArray[np.intp] | None
) -> Iterator[tuple[int, Rows]]:
    """Do as ``spread`` does, but of some ``places`` alone, which take the numbers from 0 on."""
    if places is None:
        yield from spread(rows, reaching, levels)
        return
    near = np.zeros(rows.K, np.bool_)
    for away in range(1 - levels, levels):
        near[np.clip(places + away, 0, rows.K - 1)] = True
    entries = np.flatnonzero(near[rows.places])
    number = np.full(rows.K, -1, np.int32)
    number[places] = np.arange(len(places))
    for level, beside in spread(_moved(rows, entries, 0), reaching[entries], levels):
        reached = _moved(beside, np.flatnonzero(number[beside.places] >= 0), 0)
        yield level, Rows(reached.pointers, number[reached.places], len(places))


def _moved(rows: Rows, entries: NDArray[np.intp], by: int) -> Rows:
    """Some entries of the rows, in rising order, moved along the path."""
    return Rows(np.searchsorted(entries, rows.pointers), rows.places[entries] + np.int32(by), rows.K)
