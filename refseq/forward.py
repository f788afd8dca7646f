"""Probabilities of all states, summed over all paths: view by view, and in hindsight (card H4).

Everything is kept as logarithms, since views can tell places apart by a factor of e^500 and more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from refseq.chain import Chain, Observation

BAND = 400.0
"""States are moved together while they differ by less than e^400: far from the limits of a float, e^±708."""


@dataclass(frozen=True, slots=True)
class Posterior:
    """Where the robot was at a view: the places (K,) and Lost_Places (K,), sum 1 over both.

    ``log_evidence`` is log P(view | views before), on the scale of the observation's log-likelihoods.
    """

    places: NDArray[np.float64]
    lost: NDArray[np.float64]
    log_evidence: float


class ForwardFilter:
    """P(state | views up to now), from Lost_0 (3.9): the sum-product beside Viterbi's max-product, without a window."""

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._log_states = self._chain.start()

    def update(self, observation: Observation) -> Posterior:
        """Take the next view and answer from the views up to it."""
        moved = log_moved(self._chain.transitions(observation.distance).forward, self._log_states)
        self._log_states, log_evidence = weighed(moved, observation)
        return _posterior(self._log_states, log_evidence)


def smooth(observations: Sequence[Observation], chain: Chain) -> list[Posterior]:
    """P(state | all views of the drive) at each view, by the forward-backward recursion.

    It holds all views' states at once, 16 K bytes a view.
    """
    filtered, evidence = [], []
    log_states = chain.start()
    for observation in observations:
        moved = log_moved(chain.transitions(observation.distance).forward, log_states)
        log_states, log_evidence = weighed(moved, observation)
        filtered.append(log_states)
        evidence.append(log_evidence)
    smoothed = []
    later = np.zeros((2, chain.K))  # log P(later views | state), but for a factor
    for number in reversed(range(len(observations))):
        smoothed.append(_posterior(_normalised(filtered[number] + later), evidence[number]))
        later, _ = weighed(later, observations[number])
        later = log_moved(chain.transitions(observations[number].distance).backward, later)
    return smoothed[::-1]


def log_moved(
    move: Callable[[NDArray[np.float64]], NDArray[np.float64]], log_states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Log move(exp(log_states)), for a linear move of numbers ≥ 0 that never become much larger, (2, K).

    Numbers too far apart for one floating-point exponent are moved in bands, the largest first, and added up as
    logarithms. States that lie together, as nearly always, are one band.
    """
    moved, left = None, log_states
    while (top := left.max()) > -np.inf:
        with np.errstate(divide="ignore"):  # the logarithm of 0 is −∞, as it should be
            band = top + np.log(move(_exp_within_band(left - top)))
        moved = band if moved is None else np.logaddexp(moved, band)
        left = np.where(left > top - BAND, -np.inf, left)
    return np.full_like(log_states, -np.inf) if moved is None else moved


def _exp_within_band(logs: NDArray[np.float64]) -> NDArray[np.float64]:
    numbers: NDArray[np.float64] = np.exp(logs)
    numbers[logs <= -BAND] = 0.0
    return numbers


def weighed(log_states: NDArray[np.float64], observation: Observation) -> tuple[NDArray[np.float64], float]:
    """The states' logarithms under an observation, normalised, and the logarithm of what they summed to."""
    joint = log_states.copy()
    joint[0] += observation.places
    joint[1] += observation.lost
    log_sum = float(logsumexp(joint))
    return joint - log_sum, log_sum


def _normalised(logs: NDArray[np.float64]) -> NDArray[np.float64]:
    normalised: NDArray[np.float64] = logs - logsumexp(logs)
    return normalised


def _posterior(log_states: NDArray[np.float64], log_evidence: float) -> Posterior:
    places, lost = np.exp(log_states)
    return Posterior(places, lost, log_evidence)
