"""Where one sequence runs along another: its views localised in the other, in hindsight (4.4.2)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.similarity import Translation
from refseq.inference.chain.forward import smooth
from refseq.map.matcher import Measurement
from refseq.map.tracking.stages import ChainTracker

LEAST = -2.0
"""No view tells more against a place [nats], where only likelihoods are known: one of zero would rule it out."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """For each of K views of one sequence the place in another that it most probably is, (K,), and how probable it is.

    ``on`` (K,) is the probability that the view is on the other sequence at all, ``places`` the best place if it is.
    ``nats`` (K, L) is what each view alone tells for each place: its log-likelihood ratio to elsewhere.
    """

    places: NDArray[np.intp]
    on: NDArray[np.float64]
    nats: NDArray[np.float64]


def align(translation: Translation) -> Alignment:
    """Localise the views of a sequence, translated, in the other by the chain, each in the light of all.

    Either sequence may end on the other: whatever the profile says, a view past an end has left it.
    """
    to = translation.to
    tracker = ChainTracker(to, replace(to.profile.chain, exit_at_ends=True))
    measured = list(translation.measurements())
    observations = [tracker.observation(one) for one in measured]
    posteriors = smooth(observations, tracker.chain)
    return Alignment(
        places=np.array([int(np.argmax(posterior.places)) for posterior in posteriors]),
        on=np.array([float(posterior.places.sum()) for posterior in posteriors]),
        nats=np.array([told(one) for one in measured]),
    )


def told(measured: Measurement) -> NDArray[np.float64]:
    """Evidence of a view for each place, (L,) [nats]: its log ratio, or its likelihood against an even one."""
    return measured.log_ratio if measured.log_ratio is not None else told_by_likelihood(measured)


def told_by_likelihood(measured: Measurement) -> NDArray[np.float64]:
    """Likelihood of each place against an even one, (L,) [nats]; where no log ratios are known at least ``LEAST``."""
    with np.errstate(divide="ignore"):
        nats: NDArray[np.float64] = np.log(measured.likelihood * len(measured.likelihood))
    return nats if measured.log_ratio is not None else np.maximum(nats, LEAST)
