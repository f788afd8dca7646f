"""Calibrated log-likelihood ratios: each place against being elsewhere, on a scale that can be trusted (docs/best.md).

Features are not independent: a door seen again brings a hundred words that agree with each other. The model of
``detection`` counts each of them, so its ratios are far too sure. They are therefore read as scores only. How
surprising a score is, the reference drive tells: its own views, each against the places far from it, show what a place
looks like that is not the one. The share p of such scores that are as high is a p-value, and a p-value becomes a ratio
by a calibrator, a function that averages 1 when p is uniform: an e-value (V. Vovk and R. Wang, "E-values", Annals of
Statistics 49, 2021). So a view like those brings a ratio above x for a place that is not the one in no more than 1 of
x cases.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from refseq.inference.matching.detection import Detection
from refseq.inference.matching.incidence import IncidenceMatrix, sensor_of
from refseq.inference.matching.neighbours import REACH, Neighbours
from refseq.view import LASER

CELLS = 1 << 16
"""Cells by which scores are brought into a rough order before each is looked for; no result follows it."""
TOP = 0.1
"""Share of the scores elsewhere, the highest, that tell how fast they thin out."""
FEWEST = 5
"""So many there must be: of fewer scores nothing is known beyond the highest."""
POWER_OFF = 1e-9
"""By so much a power may be off."""


@dataclass(frozen=True, slots=True)
class LogRatioSettings:
    """Calibration of the ratios.

    ``blind``, from 0 to below 1, is the chance that a view tells nothing of its place: something covers it, lamps are
    off, it changed. With a larger one a single view rules out less. Reference views are compared with places at least
    ``apart`` [m] away, ``views`` of them at most, spread evenly, for a sample of ``scores`` at most.

    ``scans`` is how many places a view's scan is laid on, as a block of its own (``refseq.map.blocks``), twice as many
    while the robot may be anywhere: each takes 3 ms; 0: none. ``scans_alone`` is the same where no camera is asked,
    if that is more. There it is laid besides on twice as many of the ``screened`` likeliest places, those at which most
    of its beams meet walls: each takes 0.2 ms; 0: words alone choose. ``geometry`` is as ``scans``, of a view's
    keys of SIFT, which a map that is learnt with it holds for each place: each takes 0.3 ms a camera. ``turns`` is how
    much of the way behind the robot the chain compares with the ways to the places
    (``refseq.map.tracking.turns_behind``) [m]; 0: none.
    ``usual`` is of how many views of the drive, whose places the chain was sure of, it remembers what they brought
    there (``refseq.map.tracking.usual``): a view by two sensors or more that brings less speaks against a place; 0:
    none. ``fixes`` is of how many places that it was sure of it compares the way since then with where others lie
    (``refseq.map.tracking.last_fixes``); 0: none.

    ``tail`` is how slowly scores of pictures elsewhere are taken to thin out beyond the highest: a multiple of how far
    the highest tenth of them exceed their own least (``Calibration``); 0: one beyond tells no more than the highest.
    """

    blind: float = 0.2
    apart: float = 4.0
    views: int = 400
    scores: int = 200_000
    scans: int = 0
    scans_alone: int = 0
    screened: int = 0
    geometry: int = 0
    turns: float = 0.0
    usual: int = 0
    fixes: int = 0
    tail: float = 0.0

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for a ``blind`` that is no such chance."""
        if not 0 <= self.blind < 1:
            raise ValueError(f"log_ratio.blind is {self.blind}; valid is at least 0 and less than 1")


class Calibration:
    """Scores to log-likelihood ratios, by the scores of places that are not the right one.

    There are no more ratios than twice the distinct scores elsewhere, and one: those of scores that tie with one of
    them, and of scores between two. All are reckoned beforehand.

    Few places make few scores, of which even the highest is nothing rare: a hundred can tell a place by a factor of
    five at most, however well it fits. With a ``tail`` one above them all tells more, the farther it lies above: the
    p-value falls from the highest's as exp(−excess / (tail · mean)), where the mean is by how much the highest tenth
    exceed the least of that tenth. It does not fall below the square of the highest's.
    """

    def __init__(self, elsewhere: NDArray[np.float64], *, tail: float = 0.0) -> None:
        self._distinct, counts = np.unique(elsewhere, return_counts=True)
        n = len(elsewhere)
        below = np.repeat(np.concatenate([[0], np.cumsum(counts)]), 2)
        as_high, higher = n - below[:-1], n - below[1:]
        tied = (as_high - higher) / n if n else np.ones(1)
        self._p = PValues((higher + 1 - tied) / (n + 1), (as_high + 1) / (n + 1))
        self._log_ratios = log_mean_calibrated(self._p)
        self._thinning = tail * _excess(elsewhere)

    def log_ratios(self, scores: NDArray[np.float64]) -> NDArray[np.float64]:
        """Calibrated log-likelihood ratios of the places with these scores."""
        slots = self._slots(scores)
        ratios = self._log_ratios[slots]
        beyond = np.flatnonzero(slots == len(self._log_ratios) - 1) if self._thinning > 0 else ()
        if len(beyond):
            least = float(self._p.high[-1])
            fallen = np.exp((self._distinct[-1] - scores[beyond]) / self._thinning)
            ratios[beyond] = log_calibrated(least * np.maximum(fallen, least))
        return ratios

    def p_values(self, scores: NDArray[np.float64]) -> "PValues":
        """Share of the places elsewhere that score as high, the place itself counted among them, and its ties.

        A score that ties with t of n elsewhere may stand before or behind any of them, so that its p-value spans their
        ranks. One that ties with all of them spans 0 to 1 and says nothing; one that ties with none is a single rank.
        """
        slots = self._slots(scores)
        return PValues(self._p.low[slots], self._p.high[slots])

    def _slots(self, scores: NDArray[np.float64]) -> NDArray[np.intp]:
        """Number of each score's ratio: those of scores between two distinct ones and at one of them take turns."""
        if not len(self._distinct):
            return np.zeros(len(scores), np.intp)
        # Many numbers are found much faster one near the other, and sixteen bits are sorted by a radix.
        low, high = self._distinct[[0, -1]]
        share = (scores - low) / (high - low) if high > low else np.zeros(len(scores))
        order = np.argsort(np.clip(CELLS * share, 0, CELLS - 1).astype(np.uint16), kind="stable")
        found = np.empty(len(scores), np.intp)
        found[order] = np.searchsorted(self._distinct, scores[order])
        slots: NDArray[np.intp] = 2 * found + (self._distinct.take(found, mode="clip") == scores)
        return slots


def _excess(scores: NDArray[np.float64]) -> float:
    """Mean of how far the highest scores lie above the least of them; 0 where that is unknown."""
    count = int(TOP * len(scores))
    if count < FEWEST:
        return 0.0
    least, *others = np.partition(scores, -count)[-count:]
    return float(np.mean(others) - least)


class PValues(NamedTuple):
    """P-values of scores, (n,) each: ``low`` to ``high``, the same but for scores that tie."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


def log_mean_calibrated(p: PValues) -> NDArray[np.float64]:
    """Logarithm of the calibrator's mean over p-values from ``low`` to ``high``, at most one of them 0."""
    # Its integral is (p − 1) / ln p, from 0 at p = 0 to 1 at p = 1.
    mean = log_calibrated(p.high)
    spans = p.high > p.low
    low, high = p.low[spans], p.high[spans]
    mean[spans] = np.log((_integral(high) - _integral(low)) / (high - low))
    return mean


def _integral(p: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(divide="ignore"):
        x = np.log(p)
    return np.divide(np.expm1(x), x, out=np.ones_like(x), where=x < 0)


def log_calibrated(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithm of (1 − p + p ln p) / (p ln² p), the mean of all calibrators κ p^(κ − 1), 0 < κ < 1."""
    log_p = np.log(np.minimum(p, 1 - 1e-4))  # its limit at 1 is a half; nearer, differences of small numbers
    p = np.exp(log_p)
    calibrated: NDArray[np.float64] = np.log((1 - p + p * log_p) / (p * log_p**2))
    return calibrated


class LogRatios(NamedTuple):
    """A view at K places: ``log_ratios`` (K,) of each to elsewhere, and ``by_block`` (K,) those of each block alone.

    The former are the sum of the latter times ``power``, of a view that may tell nothing (``unless_blind``). Of places
    with several experiences both are means over these, and the sum is that of the first experience only nearly.
    """

    log_ratios: NDArray[np.float64]
    by_block: Mapping[str, NDArray[np.float64]]
    power: float


class LogRatioModel:
    """Ratios by a reference sequence's features, block by block."""

    def __init__(self, matrix: IncidenceMatrix, along: NDArray[np.float64], settings: LogRatioSettings) -> None:
        self._K, self._blind = matrix.K, settings.blind
        chosen = np.unique(np.linspace(0, matrix.K - 1, min(matrix.K, int(settings.views))).round().astype(int))
        columns, neighbours = [matrix.by_block(one) for one in matrix.columns_of(chosen)], Neighbours.of(along)
        self._blocks: dict[str, tuple[Detection, Calibration]] = {}
        self._elsewhere: dict[str, NDArray[np.float32]] = {}
        self._powers: dict[frozenset[str], float] = {}
        for key, block in matrix.blocks.items():
            if np.isin(matrix.sightings(block), (0, matrix.K)).all():
                continue  # the same at all places, it tells none from another
            model = Detection(matrix.block(key), neighbours)
            views = [(k, column[key]) for k, column in zip(chosen, columns, strict=True)]
            scores = _elsewhere(model, views, along, settings)
            # Clutter that moved makes a laser see another place, view after view: it is told no more surely.
            calibration = Calibration(scores, tail=0.0 if sensor_of(key) == LASER else settings.tail)
            self._blocks[key] = model, calibration
            self._elsewhere[key] = calibration.log_ratios(scores).astype(np.float32)

    def log_ratios(self, observed: Mapping[str, NDArray[np.intp]]) -> NDArray[np.float64]:
        """Log-likelihood ratio of each place to elsewhere, (K,); ``observed`` has the ids seen by block."""
        return self.ratios(observed).log_ratios

    def ratios(self, observed: Mapping[str, NDArray[np.intp]]) -> LogRatios:
        """Log-likelihood ratios of each place to elsewhere; ``observed`` has the ids seen by block.

        Blocks are multiplied, and the product taken to their ``power``. One that is not observed, its sensor being
        away, says nothing, and neither does one that is the same at all places. The weighted mean of their ratio and of
        1, what a view brings that may be of any place, is a ratio too: no place falls below ``blind``.
        """
        blocks = self.by_block(observed)
        power = self.power(blocks)
        total: NDArray[np.float64] = power * sum(blocks.values(), np.zeros(self._K))
        return LogRatios(unless_blind(total, self._blind), blocks, power)

    def by_block(self, observed: Mapping[str, NDArray[np.intp]]) -> dict[str, NDArray[np.float64]]:
        """Log-likelihood ratios of each block for itself, (K,) each, but for those that say nothing."""
        found = {}
        for key, ids in observed.items():
            if key in self._blocks:
                model, calibration = self._blocks[key]
                found[key] = calibration.log_ratios(model.log_ratios(ids))
        return found

    def power(self, keys: Iterable[str]) -> float:
        """Power of the product of some blocks' ratios at which places elsewhere average 1 or less in the reference.

        Blocks of one camera, or of sensors that look at one door, are wrong together: where each averages 1, their
        product can average a hundred. The reference's own views, held out, tell by how much.
        """
        chosen = frozenset(keys)
        if chosen not in self._powers:
            products = sum((self._elsewhere[key] for key in sorted(chosen)), np.zeros(1, np.float32))
            self._powers[chosen] = power_of(products.astype(np.float64))
        return self._powers[chosen]


def unless_blind(log_ratios: NDArray[np.float64], blind: float) -> NDArray[np.float64]:
    """Log ratios of a view that tells nothing of its place, being as likely anywhere, with a chance of ``blind``."""
    if not blind:
        return log_ratios
    mixed: NDArray[np.float64] = np.logaddexp(np.log(blind), np.log1p(-blind) + log_ratios)
    return mixed


def with_more(log_ratios: NDArray[np.float64], more: NDArray[np.float64], blind: float) -> NDArray[np.float64]:
    """Log ratios (K,) of a view (``unless_blind``) that tells ``more`` (K,) where it is not blind.

    The more that speaks against a place, the nearer its ratio comes to what a blind view tells; one below stays there.
    """
    if not blind:
        return log_ratios + more
    seeing = np.exp(log_ratios) - blind
    told = np.log(blind + np.maximum(seeing, 0.0) * np.exp(more))
    mixed: NDArray[np.float64] = np.where(seeing > 0, told, log_ratios)
    return mixed


def power_of(log_ratios: NDArray[np.float64]) -> float:
    """The largest power up to 1 at which ratios average 1 or less; 0 where none does."""

    def log_mean(powers: NDArray[np.float64]) -> float:
        return float(logsumexp(powers) - np.log(len(powers)))

    if not len(log_ratios) or log_mean(log_ratios) <= 0:
        return 1.0
    if log_ratios.mean() >= 0:
        return 0.0
    # Convex in the power, and 0 at 0: from above its other root Newton's steps come down to it, and do not pass it.
    power, step = 1.0, 1.0
    while step > POWER_OFF:
        powers = power * log_ratios
        step = log_mean(powers) / float(softmax(powers) @ log_ratios)
        power -= step
    return max(power, 0.0)


def _elsewhere(
    model: Detection,
    views: list[tuple[int, NDArray[np.intp]]],
    along: NDArray[np.float64],
    settings: LogRatioSettings,
) -> NDArray[np.float64]:
    """Scores of reference views at places far from them, those of views that show nothing among them."""
    kept = max(1, int(settings.scores) // max(len(views), 1))
    scores = []
    for k, ids in views:
        far = np.flatnonzero((np.abs(along - along[k]) > settings.apart) & (np.abs(np.arange(len(along)) - k) > REACH))
        if len(far):
            scores.append(model.log_ratios(ids, held_out=True, places=far[:: -(-len(far) // kept)]))
    return np.concatenate(scores) if scores else np.zeros(0)
