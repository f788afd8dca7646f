"""Where one sequence runs along another: its views localised in the other, in hindsight (4.4.2)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.similarity import Translation
from refseq.inference.chain.forward import smooth
from refseq.map.stages import ChainTracker


@dataclass(frozen=True, slots=True)
class Alignment:
    """For each of K views of one sequence the place in another that it most probably is, (K,), and how probable it is.

    ``on`` (K,) is the probability that the view is on the other sequence at all, ``places`` the best place if it is.
    """

    places: NDArray[np.intp]
    on: NDArray[np.float64]


def align(translation: Translation, seed: int = 0) -> Alignment:
    """Localise the views of a sequence, translated, in the other by the chain, each in the light of all.

    Either sequence may end on the other: whatever the profile says, a view past an end has left it.
    """
    to = translation.to
    tracker = ChainTracker(to, replace(to.profile.chain, exit_at_ends=True))
    observations = [tracker.observation(measured) for measured in translation.measurements(seed=seed)]
    posteriors = smooth(observations, tracker.chain)
    return Alignment(
        places=np.array([int(np.argmax(posterior.places)) for posterior in posteriors]),
        on=np.array([float(posterior.places.sum()) for posterior in posteriors]),
    )
