"""Mutual information of features and views with the place, in bits (card B8, section 2.5).

The place k is uniform over the K places of a reference sequence, so that log2 K bits are all there is to know. I(X; k)
is what is known of it, on average, once X is seen: a single feature, or a view's features of an extractor, a sensor or
all. With a matrix taken at its word a view tells nearly everything, since hardly two columns are alike. What a later
drive sees is a noisy copy: a feature that is there is detected with a rate below one, and others are seen by mistake.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import entr, logsumexp, xlogy

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.neighbours import Neighbours

LN2 = math.log(2)


@dataclass(frozen=True, slots=True)
class Noise:
    """Rates of seeing a feature again: ``detection`` is P(seen | there), ``false_alarm`` is P(seen | not there)."""

    detection: float
    false_alarm: float

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for what is no probability."""
        for name, rate in (("detection", self.detection), ("false_alarm", self.false_alarm)):
            if not 0 <= rate <= 1:
                raise ValueError(f"{name} {rate} is no probability; valid is 0 to 1")


NOISELESS = Noise(1.0, 0.0)
"""The matrix taken at its word."""


@dataclass(frozen=True, slots=True)
class Information:
    """``bits`` that are told about the place on average, of ``limit`` = log2 K; ``error`` is their standard error."""

    bits: float
    limit: float
    error: float = 0.0


def feature_information(matrix: IncidenceMatrix, block: range, noise: Noise = NOISELESS) -> NDArray[np.float64]:
    """I(x_j; k) of each feature of a block by itself, (len(block),) [bits].

    I = h(s p + (1 − s) q) − s h(p) − (1 − s) h(q), where s is the share of places that have the feature, p its
    detection rate, q its false-alarm rate, and h the entropy of a coin. Without noise it is h(s): a feature of half of
    the places tells one bit, and none tells more.
    """
    p, q = noise.detection, noise.false_alarm
    s = matrix.sightings(block) / matrix.K
    bits = coin_entropy(s * p + (1 - s) * q) - s * coin_entropy(p) - (1 - s) * coin_entropy(q)
    return np.maximum(bits, 0.0)  # a rounding error must not make it negative


def column_information(matrix: IncidenceMatrix, *blocks: range) -> Information:
    """I(v; k) of whole views made of some blocks' features, without any of all, the matrix taken at its word: exact.

    It is the entropy of the groups that places with the same column form.
    """
    chosen = np.zeros(matrix.N, np.bool_)
    for block in blocks or (range(matrix.N),):
        chosen[block.start : block.stop] = True
    groups = Counter(rows[chosen[rows]].tobytes() for rows in matrix.columns())
    sizes = np.array(list(groups.values()))
    limit = math.log2(matrix.K)
    return Information(limit - float(sizes @ np.log2(sizes)) / matrix.K, limit)


def neighbour_noise(matrix: IncidenceMatrix, block: range, neighbours: Neighbours | None = None) -> Noise:
    """Rates at which a block's features are seen again at the next place, as if it were the same place later.

    The one estimate that a map gives by itself. It knows nothing of another light, and takes for noise what the robot's
    own motion changes. ``neighbours`` tell of gaps, over which no place is the next one. Half a sighting is
    added to either side, so that no rate is 0 or 1 for want of places.
    """
    first, last = matrix.pointers[block.start], matrix.pointers[block.stop]
    places = matrix.places[first:last].astype(np.int64)
    rows = np.repeat(np.arange(len(block)), matrix.sightings(block))
    beside = neighbours or Neighbours.even(matrix.K)
    starts = beside.first[places]
    # Places rise within a row, so that the next place, if the feature is there as well, is the next entry.
    again = int(((np.diff(rows) == 0) & (np.diff(places) == 1) & (np.diff(starts) == 0)).sum())
    there = int((places < beside.last[places]).sum())
    new = int((places > starts).sum()) - again
    absent = len(block) * (matrix.K - beside.stretches) - there
    return Noise((again + 0.5) / (there + 1), (new + 0.5) / (absent + 1))


def view_information(
    matrix: IncidenceMatrix, noise: Mapping[str, Noise], rng: np.random.Generator, draws: int = 1000
) -> Information:
    """I(v; k) of whole views made of some extractors' features, those that ``noise`` names.

    A view of place k is drawn from the model: each feature independently, as its extractor's noise has it. Its
    posterior P(k | v) is exact; log2 K less the mean entropy of ``draws`` posteriors is an unbiased estimate of
    I(v; k). Features that err together, as the counts of walls do, tell less than this says.

    Raises ``ValueError`` without draws.
    """
    if draws < 1:
        raise ValueError(f"{draws} draws; valid is at least one")
    blocks = [_Block(matrix, matrix.blocks[key], of_key) for key, of_key in noise.items()]
    places = ((np.arange(draws) + rng.random(draws)) * matrix.K / draws).astype(int)  # spread evenly over the sequence
    return posterior_information([_posterior([block.likelihood(place, rng) for block in blocks]) for place in places])


def posterior_information(posteriors: Sequence[NDArray[np.float64]]) -> Information:
    """Information of views by the localiser's own posteriors (K,): log2 K less their mean entropy.

    It is I(v; k) where the posteriors mean what they say, and more where they are surer than right.
    """
    limit = math.log2(len(posteriors[0]))
    bits = limit - np.array([entr(posterior).sum() for posterior in posteriors]) / LN2
    return _mean(np.clip(bits, 0, limit), limit)


def proven_information(posteriors: Sequence[NDArray[np.float64]], places: Sequence[int]) -> Information:
    """Information of views as the true ``places`` prove it: log2 K plus the mean of log2 P(true place | v).

    On average I(v; k) is no less, whatever made the posteriors (Barber and Agakov's bound, NIPS 2003); a sure answer
    that is wrong costs dearly. Below zero it would have been better to say nothing; it is −∞ when a true place had been
    ruled out.
    """
    limit = math.log2(len(posteriors[0]))
    with np.errstate(divide="ignore"):
        bits = limit + np.log2([posterior[place] for posterior, place in zip(posteriors, places, strict=True)])
    return _mean(bits, limit)


class _Block:
    """The features of one extractor as a channel: from a place to what is seen there, and back."""

    def __init__(self, matrix: IncidenceMatrix, block: range, noise: Noise) -> None:
        self._rows = matrix.zeros_and_ones(block)
        self._columns = self._rows.tocsc()
        self._there = np.diff(self._columns.indptr)
        self._noise = noise

    def likelihood(self, place: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw what is seen at a place, and give its log-likelihood at all places, (K,)."""
        n, p, q = self._rows.shape[0], self._noise.detection, self._noise.false_alarm
        rates = np.full(n, q)
        rates[self._columns.indices[self._columns.indptr[place] : self._columns.indptr[place + 1]]] = p
        seen = rng.random(n) < rates
        hits = seen @ self._rows
        alarms = seen.sum() - hits
        absent = n - self._there
        of_there = xlogy(hits, p) + xlogy(self._there - hits, 1 - p)
        of_absent = xlogy(alarms, q) + xlogy(absent - alarms, 1 - q)
        score: NDArray[np.float64] = of_there + of_absent
        return score


def _posterior(log_likelihoods: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """P(k | v), (K,), under a uniform prior, of what is independent given the place."""
    joint = np.sum(log_likelihoods, axis=0)
    posterior: NDArray[np.float64] = np.exp(joint - logsumexp(joint))
    return posterior


def coin_entropy(p: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Entropy of a coin that falls on one side with probability p [bits]."""
    bits: NDArray[np.float64] = (entr(p) + entr(1 - np.asarray(p))) / LN2
    return bits


def _mean(bits: NDArray[np.float64], limit: float) -> Information:
    """Mean and standard error."""
    if not np.isfinite(bits).all():
        return Information(float(bits.mean()), limit, math.inf)
    spread = 0.0 if len(bits) == 1 else np.std(bits)  # scores ask view by view
    return Information(float(bits.mean()), limit, float(spread / math.sqrt(len(bits))))
