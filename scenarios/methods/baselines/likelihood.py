"""Likelihoods of places from the cosines of their vectors, as the Bayes filters of Xu et al. take them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SPREAD = (0.025, 0.975)
"""Quantiles between which the distances are taken to spread."""


@dataclass
class SimilarityLikelihood:
    """P(view | place k) ∝ exp(−λ d_k), d_k being the Euclidean distance between the two vectors of length 1.

    λ is such that going from the 2.5 % to the 97.5 % quantile of the distances makes a view ``contrast`` times less
    likely. The distances grow alike with a change of light, so λ is set on the query drive itself: from the spread of
    its views so far, on average, where Xu et al. take the first view alone.

    M. Xu, N. Sünderhauf, M. Milford, "Probabilistic visual place recognition for hierarchical localization", RA-L 6(2),
    2021, section III.
    """

    contrast: float
    _spreads: float = 0.0
    _views: int = 0

    def reset(self) -> None:
        """Forget the views seen."""
        self._spreads, self._views = 0.0, 0

    def __call__(self, cosines: NDArray[np.float64]) -> NDArray[np.float64]:
        """Likelihood of each place (K,), 1 for the one that looks most alike, from ``cosines`` (K,)."""
        distances = np.sqrt(np.maximum(2 - 2 * cosines, 0))
        low, high = np.quantile(distances, SPREAD)
        self._spreads, self._views = self._spreads + float(high - low), self._views + 1
        spread = self._spreads / self._views
        if spread == 0:
            return np.ones(len(distances))
        return np.exp(-np.log(self.contrast) / spread * (distances - distances.min()))
