"""Ranking metrics: precision and recall, area under the ROC curve, false positive rate."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
