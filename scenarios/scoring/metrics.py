"""Metrics of ranking and calibration: precision and recall, ROC, reliability of probabilities."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BINS = 10
"""Bins of a reliability diagram."""


@dataclass(frozen=True)
class Retrieval:
    """Precision and recall over all distinct scores, from the surest answer on; ``recall`` rises.

    An answer's score is (1 − P(lost)) × the top place's probability. Precision counts right answers among those given,
    off the map too; recall counts them among all views on the map, so that it ends at the share of right top places.
    """

    thresholds: NDArray[np.float64]
    precision: NDArray[np.float64]
    recall: NDArray[np.float64]

    @property
    def auc(self) -> float:
        """Area under the steps of the curve (average precision)."""
        return float(np.sum(np.diff(self.recall, prepend=0.0) * self.precision))

    def recall_at(self, precision: float) -> float:
        """Largest recall that keeps at least this precision, 0 when none does."""
        enough = self.precision >= precision
        return float(self.recall[enough].max()) if enough.any() else 0.0


def auroc(positives: NDArray[np.float64], negatives: NDArray[np.float64]) -> float | None:
    """Chance that a positive scores above a negative, ties counting half (Mann & Whitney); ``None`` without both."""
    if not (len(positives) and len(negatives)):
        return None
    ordered = np.sort(negatives)
    below = np.searchsorted(ordered, positives, side="left")
    not_above = np.searchsorted(ordered, positives, side="right")
    return float((below + not_above).sum() / (2 * len(positives) * len(negatives)))


def false_positive_rate(
    positives: NDArray[np.float64], negatives: NDArray[np.float64], true_positive_rate: float
) -> float | None:
    """Share of negatives at or above the highest threshold that enough positives reach; ``None`` without both."""
    if not (len(positives) and len(negatives)):
        return None
    needed = math.ceil(true_positive_rate * len(positives) - 1e-9)
    threshold = np.sort(positives)[len(positives) - needed]
    return float(np.mean(negatives >= threshold))


def retrieval(scores: NDArray[np.float64], right: NDArray[np.bool_], relevant: int) -> Retrieval:
    """Precision and recall when all answers with at least a score are taken, for every distinct score.

    ``scores`` and ``right`` are (n,); ``relevant`` is the number of views that have a right answer.
    """
    thresholds, taken = np.unique(-scores, return_counts=True)
    ends = np.cumsum(taken)
    hits = np.cumsum(right[np.argsort(-scores, kind="stable")])[ends - 1]
    return Retrieval(-thresholds, hits / ends, hits / relevant)


@dataclass(frozen=True, slots=True)
class Reliability:
    """Views sorted by a probability into equal bins of [0, 1]; arrays are (B,), one entry a bin.

    ``probability`` is the mean in each bin and ``share`` how often the event came true, both nan in an empty bin;
    ``count`` is the number of views.
    """

    probability: NDArray[np.float64]
    share: NDArray[np.float64]
    count: NDArray[np.int64]

    @property
    def error(self) -> float:
        """Expected calibration error (ECE): |probability − share|, averaged over the views; nan without any."""
        total, there = int(self.count.sum()), self.count > 0
        if not total:
            return math.nan
        gaps = np.abs(self.probability - self.share)[there]
        return float((gaps * self.count[there]).sum() / total)


def reliability(probabilities: NDArray[np.float64], hits: NDArray[np.bool_], bins: int = BINS) -> Reliability:
    """Compare probabilities (n,) with what came true (n,). A bin holds its lower edge, the last one both edges."""
    index = np.minimum((probabilities * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins)
    with np.errstate(invalid="ignore"):
        probability = np.bincount(index, weights=probabilities, minlength=bins) / count
        share = np.bincount(index, weights=hits, minlength=bins) / count
    return Reliability(probability, share, count)
