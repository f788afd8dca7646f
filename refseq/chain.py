"""The complete reference sequence: K places, a Lost_Place before each, and what they emit (card H1 to H3).

Nothing here is a matrix of 4 K² transitions: the chain is kept as its structure, and one step costs O(K log K).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.motion import MotionSettings, MotionWindow


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """Parameters of the chain.

    ``lost`` is the probability of going on from a place to the Lost_Place behind it (0.5 in 3.5, 3.6), and of staying
    at a Lost_Place. ``near`` [m] is how far from where it got lost the robot is likely to turn up. ``noise`` makes the
    places' emissions non-zero. A posterior whose entropy is above ``lost_view_entropy`` · log K is the Lost View; a
    place emits it with probability ``lost_view_at_place``, a Lost_Place with ``lost_view_at_lost``, and any view of
    the sequence alike (3.8). The thesis gives only ``lost`` and ``window``, T, the number of observations; the others
    are choices.
    """

    window: int = 5
    lost: float = 0.5
    near: float = 10.0
    noise: float = 0.1
    lost_view_entropy: float = 0.8
    lost_view_at_place: float = 0.1
    lost_view_at_lost: float = 0.5


@dataclass(frozen=True, slots=True)
class Emissions:
    """P(observed symbol | place), the similarity of the reference views among themselves, made non-zero.

    ``similarity`` (K, K) has as row i the mixture posterior of reference view i. The symbols are the K views and the
    Lost View.
    """

    similarity: NDArray[np.float64]
    settings: ChainSettings

    def log_likelihood(self, posterior: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Of an observed view's posterior (K,): the log-likelihood of each place (K,), and of any Lost_Place.

        The posterior is soft evidence on which of the views is seen, so a place's likelihood is the mean of its row
        under it; the thesis' hard symbol is the case of a posterior that is sure.
        """
        K, s = len(posterior), self.settings
        if is_lost_view(posterior, s):
            return np.full(K, np.log(s.lost_view_at_place)), float(np.log(s.lost_view_at_lost))
        seen = (1 - s.noise) * (self.similarity @ posterior) + s.noise / K
        return np.log((1 - s.lost_view_at_place) * seen), float(np.log((1 - s.lost_view_at_lost) / K))


def is_lost_view(posterior: NDArray[np.float64], settings: ChainSettings) -> bool:
    """Whether the posterior says too little to be any view of the sequence."""
    return normalised_entropy(posterior) > settings.lost_view_entropy


def entropy(distribution: NDArray[np.float64]) -> float:
    """Entropy [nats]; 0 · log 0 is 0."""
    positive = distribution[distribution > 0]
    return float(-(positive * np.log(positive)).sum())


def normalised_entropy(distribution: NDArray[np.float64]) -> float:
    """Entropy as a share of the uniform distribution's: 0 is sure, 1 knows nothing; a single place is always sure."""
    return entropy(distribution) / np.log(len(distribution)) if len(distribution) > 1 else 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """The best ways to every state in one step: log scores (K,) and the states they come from (K,).

    States 0 to K − 1 are the places, K to 2 K − 1 the Lost_Places.
    """

    places: NDArray[np.float64]
    places_from: NDArray[np.intp]
    lost: NDArray[np.float64]
    lost_from: NDArray[np.intp]


class Transitions:
    """The moves of the complete reference sequence (3.3 to 3.6), for one travelled distance.

    * P_i → P_k by the motion window, and P_i → Lost_{i+1}, in the shares 1 − ``lost`` and ``lost``. Staying (k = i) is
      allowed, or a standing robot would be lost. No Lost_Place lies behind the last place: it leads to the last one.
    * Lost_i → Lost_i with probability ``lost``, to no other Lost_Place (3.4).
    * Lost_i → P_k for k ≥ i, since Lost_i lies before P_i; nearer ones are likelier, as exp(−distance / ``near``).
      From Lost_0, where nothing is known, to all places alike (3.3).

    Every row sums to 1.
    """

    def __init__(
        self, along: NDArray[np.float64], distance: float, motion: MotionSettings, settings: ChainSettings
    ) -> None:
        self._window = MotionWindow(along, distance, motion)
        K = len(along)
        self._log_go = np.log(1 - settings.lost)
        self._log_leave = self._log_stay = np.log(settings.lost)
        self._decay = along / settings.near
        # log Σ_{k ≥ i} exp(−(s_k − s_i) / near), from the end of the path.
        tail = np.logaddexp.accumulate(-self._decay[::-1])[::-1]
        self._log_found = np.log(1 - settings.lost) - tail
        self._log_found_anywhere = np.log(1 - settings.lost) - np.log(K)

    def best(self, places: NDArray[np.float64], lost: NDArray[np.float64]) -> Step:
        """Maximum over the states before of log score + log transition, for every state."""
        K = len(places)
        on, on_from = self._window.best(places + self._log_go)
        found, found_from = self._best_found(lost)
        new_places = np.maximum(on, found)
        places_from = np.where(on >= found, on_from, K + found_from)

        stay = lost + self._log_stay
        leave = places + self._log_leave
        into, into_from = np.full(K, -np.inf), np.zeros(K, np.intp)
        into[1:], into_from[1:] = leave[:-1], np.arange(K - 1)
        if leave[-1] > into[-1]:
            into[-1], into_from[-1] = leave[-1], K - 1
        new_lost = np.maximum(stay, into)
        lost_from = np.where(stay >= into, K + np.arange(K), into_from)
        return Step(new_places, places_from, new_lost, lost_from)

    def _best_found(self, lost: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Best way from a Lost_Place to each place: a running maximum along the path."""
        outgoing = lost + self._log_found
        outgoing[0] = -np.inf  # Lost_0 favours no place
        running = np.maximum.accumulate(outgoing)
        # A running maximum stands where the value itself reaches it.
        source = np.maximum.accumulate(np.where(outgoing == running, np.arange(len(lost)), 0))
        near = running - self._decay
        anywhere = lost[0] + self._log_found_anywhere
        return np.maximum(near, anywhere), np.where(near > anywhere, source, 0)


@dataclass(frozen=True, slots=True)
class Observation:
    """One view as the chain sees it: the distance since the last one [m], and the states' log-likelihoods."""

    distance: float
    places: NDArray[np.float64]
    lost: float


@dataclass(frozen=True, slots=True)
class Decoding:
    """Viterbi's answer: the last scores as probabilities (sum 1 over both), and the best path, oldest first.

    A path's states are places 0 to K − 1 and Lost_Places K to 2 K − 1.
    """

    places: NDArray[np.float64]
    lost: NDArray[np.float64]
    path: tuple[int, ...]


def viterbi(
    observations: Sequence[Observation], along: NDArray[np.float64], motion: MotionSettings, settings: ChainSettings
) -> Decoding:
    """Best states for the observations (Fig. 3.9), from Lost_0 before the first of them (3.9)."""
    K = len(along)
    places, lost = np.full(K, -np.inf), np.full(K, -np.inf)
    lost[0] = 0.0
    steps: list[Step] = []
    for observation in observations:
        step = Transitions(along, observation.distance, motion, settings).best(places, lost)
        places, lost = step.places + observation.places, step.lost + observation.lost
        steps.append(step)
    scores = np.concatenate([places, lost])
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    return Decoding(weights[:K], weights[K:], _backtrack(steps, int(np.argmax(scores)), K))


def _backtrack(steps: Sequence[Step], state: int, K: int) -> tuple[int, ...]:
    path = [state]
    for step in reversed(steps[1:]):
        state = int(step.places_from[state] if state < K else step.lost_from[state - K])
        path.append(state)
    return tuple(reversed(path))
