"""Whether what is called 80 % probable happens in 80 % of the cases."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BINS = 10


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
