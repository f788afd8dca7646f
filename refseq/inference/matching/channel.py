"""Features as noisy channels of one bit (6.4.2, Fig. 6.5): learnt from a second drive, with their capacity.

A place sends each feature as 1 or 0, there or not, and a view receives it: a 1 with the rate of detection, a 0 as 1
with that of false alarms. The Z-channel has no false alarms, which suits features that are hardly alike, as SIFT keys;
the asymmetric one has both.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import Noise, coin_entropy

Sighting = tuple[int, NDArray[np.intp]]
"""A view of a second drive: the place where it was taken, and the features of a block that it shows, from 0."""
STRENGTH = 4.0
"""Views by which a block's rates count for each of its features: fewer follow chance, more tell features less apart."""
LEAST = 1e-4
"""Rates stay so far from 0 and 1: no view, however strange, makes a place impossible."""


def capacity(noise: Noise) -> float:
    """Capacity of a feature [bits]: the most that it can tell, were it at the best share of the places.

    Of the asymmetric channel in closed form; with a = P(seen | not there) and b = P(not seen | there) it is
    [a h(b) − (1 − b) h(a)] / (1 − a − b) + log2(1 + 2^([h(a) − h(b)] / (1 − a − b))).
    """
    a, b = noise.false_alarm, 1 - noise.detection
    slope = 1 - a - b
    if abs(slope) < 1e-9:
        return 0.0
    at_a, at_b = float(coin_entropy(a)), float(coin_entropy(b))
    return max(0.0, (a * at_b - (1 - b) * at_a) / slope + float(np.logaddexp2(0.0, (at_a - at_b) / slope)))


def z_channel(noise: Noise) -> Noise:
    """The same without false alarms."""
    return replace(noise, false_alarm=0.0)


@dataclass(frozen=True, slots=True)
class FeatureCounts:
    """Views of a drive by a block's n features, (n,) each: at places with it and at others, and those that show it.

    ``there`` and ``detected`` are of places with the feature, ``absent`` and ``alarms`` of the others.
    """

    there: NDArray[np.int64]
    detected: NDArray[np.int64]
    absent: NDArray[np.int64]
    alarms: NDArray[np.int64]

    @property
    def noise(self) -> Noise:
        """Rates of all features together; half a view is added to either side, so that no rate is 0 or 1."""
        there, detected, absent, alarms = (
            int(one.sum()) for one in (self.there, self.detected, self.absent, self.alarms)
        )
        return Noise((detected + 0.5) / (there + 1), (alarms + 0.5) / (absent + 1))

    def rates(self, strength: float = STRENGTH) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Detection and false alarms of each feature, (n,) each: its own, and the block's for ``strength`` views."""
        common = self.noise
        p = (self.detected + strength * common.detection) / (self.there + strength)
        q = (self.alarms + strength * common.false_alarm) / (self.absent + strength)
        return np.clip(p, LEAST, 1 - LEAST), np.clip(q, LEAST, 1 - LEAST)


def feature_counts(matrix: IncidenceMatrix, block: range, sightings: Iterable[Sighting]) -> FeatureCounts:
    """Count how the features of a block are seen again in a second drive."""
    rows = matrix.zeros_and_ones(block)
    visits, views = np.zeros(matrix.K, np.int64), 0
    seen, detected = np.zeros(len(block), np.int64), np.zeros(len(block), np.int64)
    columns = rows.tocsc()
    for place, ids in sightings:
        visits[place] += 1
        views += 1
        seen[ids] += 1
        here = columns.indices[columns.indptr[place] : columns.indptr[place + 1]]
        detected[np.intersect1d(ids, here)] += 1
    there = np.asarray(rows @ visits, np.int64)
    return FeatureCounts(there, detected, views - there, seen - detected)


class ChannelModel:
    """Naive Bayes over features that err each by itself, as their channels do; ``counts`` by block."""

    def __init__(self, matrix: IncidenceMatrix, counts: Mapping[str, FeatureCounts]) -> None:
        self._blocks = {key: _BlockChannel(matrix.zeros_and_ones(matrix.blocks[key]), of) for key, of in counts.items()}
        self._K = matrix.K

    def log_likelihood(self, seen: Mapping[str, NDArray[np.intp]]) -> NDArray[np.float64]:
        """Log P(view | place), (K,), but for a factor; ``seen`` has the ids by block, one that is away says nothing."""
        return sum((self._blocks[key].log_likelihood(ids) for key, ids in seen.items()), np.zeros(self._K))


class _BlockChannel:
    """A block's log-likelihood: what all its features missed would weigh, and what each one seen weighs more."""

    def __init__(self, rows: sparse.csr_array, counts: FeatureCounts) -> None:
        p, q = counts.rates()
        missed = np.log1p(-p) - np.log1p(-q)
        self._rows, self._none = rows, missed @ rows
        self._gain = np.log(p) - np.log(q) - missed

    def log_likelihood(self, ids: NDArray[np.intp]) -> NDArray[np.float64]:
        score: NDArray[np.float64] = self._none + self._gain[ids] @ self._rows[ids]
        return score
