"""The best states for the last T views, and the best path of a whole drive (Fig. 3.9, card H4)."""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Chain, Observation, Transitions


@dataclass(frozen=True, slots=True)
class Decoding:
    """Viterbi's answer: the last scores as probabilities (sum 1 over both), and the best path, oldest first.

    A path's states are places 0 to K − 1 and Lost_Places K to 2 K − 1.
    """

    places: NDArray[np.float64]
    lost: NDArray[np.float64]
    path: tuple[int, ...]


class SlidingViterbi:
    """Viterbi over the last T = ``window`` views: causal, and started anew from Lost_0 for every view (3.9).

    The first view of a window moves on with every view, so that all scores change and are reckoned anew; what costs
    most, a view's transitions, is kept while the view is in the window.
    """

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self._observations: deque[Observation] = deque(maxlen=int(chain.settings.window))
        self._transitions: deque[Transitions] = deque(maxlen=int(chain.settings.window))

    def reset(self) -> None:
        """Forget all views seen."""
        self._observations.clear()
        self._transitions.clear()

    def update(self, observation: Observation) -> Decoding:
        """Decode the window that ends with this view."""
        if observation.again and self._observations:
            self._observations[-1] = observation
        else:
            self._observations.append(observation)
            self._transitions.append(self._chain.transitions(observation.distance))
        return _decode(self._observations, self._transitions.__getitem__, self._chain)


def viterbi(observations: Sequence[Observation], chain: Chain) -> Decoding:
    """Best states for the observations, at least one, from Lost_0 before the first of them (3.9).

    It holds all views' scores at once, 16 K bytes a view.
    """
    return _decode(observations, lambda t: chain.transitions(observations[t].distance), chain)


def forward_scores(
    observations: Iterable[Observation], transitions: Callable[[int], Transitions], chain: Chain
) -> list[NDArray[np.float64]]:
    """Scores of the best way to each state of each view, (2, K), the view's own likelihood among them."""
    scored: list[NDArray[np.float64]] = []
    for t, observation in enumerate(observations):
        scores = transitions(t).best(scored[-1]) if t else chain.start()
        scores[0] += observation.places
        scores[1] += observation.lost
        scored.append(scores)
    return scored


def _decode(observations: Iterable[Observation], transitions: Callable[[int], Transitions], chain: Chain) -> Decoding:
    """Viterbi, with view t's transitions from ``transitions(t)``."""
    scored = forward_scores(observations, transitions, chain)
    scores = scored[-1]
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    path = [int(np.argmax(scores))]
    # Where each state came from is asked of the states on the path alone.
    for t in reversed(range(1, len(scored))):
        path.append(int(np.argmax(scored[t - 1] + transitions(t).predecessors(path[-1]))))
    return Decoding(weights[0], weights[1], tuple(reversed(path)))
