"""The Lost View: which views are taken for that of no place, and how often each kind of state shows it (card H3)."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from refseq.belief import normalised_entropy


class LostView(StrEnum):
    """Rules for which views are the Lost View.

    ``entropy``: those whose distribution over the places has an entropy above a share of log K, which is set; such a
    view says nothing else (3.3.2, Fig. 3.8). ``learnt``: the same with a threshold, and shares of views above it at
    places and elsewhere, that the reference drive itself gives (``HeldOutViews``); the view keeps what it says of the
    places. ``average``: the Lost View is the average feature combination of the sequence (1.4.3), one more column to
    compare a view with, and a view is as much the Lost View as it fits that. ``none``: there is none; a Lost_Place
    shows all views of the sequence alike (3.8).
    """

    ENTROPY = "entropy"
    LEARNT = "learnt"
    AVERAGE = "average"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class LostViewSymbol:
    """A ``threshold`` of normalised entropy, and how probable a view above it is at a place and at a Lost_Place."""

    threshold: float
    at_place: float
    at_lost: float

    def log_likelihoods(self, distribution: NDArray[np.float64]) -> tuple[float, float]:
        """Log-likelihood of a view, above the threshold or not, at a place and at a Lost_Place."""
        above = is_above(self.threshold, distribution)
        place, lost = (share if above else 1 - share for share in (self.at_place, self.at_lost))
        return float(np.log(place)), float(np.log(lost))


NO_SYMBOL = LostViewSymbol(1.0, 0.5, 0.5)
"""A symbol that says nothing, for want of places that are elsewhere."""


def is_above(threshold: float, distribution: NDArray[np.float64]) -> bool:
    """True where the entropy of a distribution over places, as a share of log K, is above the threshold."""
    return normalised_entropy(distribution) > threshold


@dataclass
class HeldOutViews:
    """Normalised entropies of reference views, each compared with places that are not its own.

    ``beside`` are those of views whose own place alone is taken out, as of a view between places; ``elsewhere`` those
    of views that all places up to ``apart`` [m] away are taken out for, as off the map. ``along`` (K,) are the places'
    distances along the path [m].
    """

    along: NDArray[np.float64]
    apart: float
    beside: list[float] = field(default_factory=list)
    elsewhere: list[float] = field(default_factory=list)

    def add(self, place: int, likelihood: NDArray[np.float64]) -> None:
        """Take a reference view by its place and its likelihoods (K,) at all places."""
        others = np.arange(len(self.along)) != place
        far = np.abs(self.along - self.along[place]) > self.apart
        for kept, entropies in ((others, self.beside), (far, self.elsewhere)):
            if kept.sum() > 1:
                entropies.append(normalised_entropy(renormalised(likelihood[kept])))

    def symbol(self) -> LostViewSymbol:
        """The threshold that tells the two kinds apart best (Youden's J), and their shares above it.

        Each kind counts as if one view more were above and one below, so that no share is 0 or 1.
        """
        if not self.elsewhere:
            return NO_SYMBOL
        beside, elsewhere = np.array(self.beside), np.array(self.elsewhere)
        entropies = np.unique(np.concatenate([beside, elsewhere]))
        between = (entropies[1:] + entropies[:-1]) / 2 if len(entropies) > 1 else entropies
        youden = [(elsewhere > one).mean() - (beside > one).mean() for one in between]
        threshold = float(between[int(np.argmax(youden))])
        shares = (((kind > threshold).sum() + 1) / (len(kind) + 2) for kind in (beside, elsewhere))
        return LostViewSymbol(threshold, *map(float, shares))


def renormalised(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights as a distribution: uniform where they are all too small to be told from 0."""
    total = weights.sum()
    return weights / total if total > 0 else np.full(len(weights), 1 / len(weights))
