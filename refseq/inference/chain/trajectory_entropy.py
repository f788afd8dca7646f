"""Entropy of the trajectory, the uncertainty of a whole path given all views (card H7; Hernando et al. 2005)."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Chain, Observation, Transitions
from refseq.inference.chain.forward import log_moved, weighed


def trajectory_entropy(observations: Iterable[Observation], chain: Chain) -> float:
    """H(states at all views | all views) [nats], from Lost_0 before the first of them.

    A recursion beside the forward one. With c(i) the filtered probabilities, f(j) = Σ_i c(i) a_ij and
    r_ij = c(i) a_ij / f(j) the probability of having come from i,

        H(j) = Σ_i r_ij (H'(i) − log r_ij)
             = [Σ_i a_ij c(i) (H'(i) − log c(i)) − Σ_i c(i) a_ij log a_ij] / f(j) + log f(j)

    is the entropy of the paths that end in j. Both sums are moves of the chain, so a view costs as much as
    a step of it.
    """
    log_c, H = chain.start(), np.zeros((2, chain.K))
    for number, observation in enumerate(observations):
        if number:
            log_c, H = _moved(chain.transitions(observation.distance), log_c, H)
        log_c, _ = weighed(log_c, observation)
    return float((np.exp(log_c) * _with_own(H, log_c)).sum())


def _moved(
    transitions: Transitions, log_c: NDArray[np.float64], H: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Log f and H(j) after the move."""
    log_f = log_moved(transitions.predict, log_c)
    inherited = log_moved(transitions.predict, log_c + _log(_with_own(H, log_c)))
    added = log_moved(transitions.surprise, log_c)
    reached = np.isfinite(log_f)
    scale = np.where(reached, log_f, 0.0)
    H = np.exp(inherited - scale) + np.exp(added - scale) + scale
    return log_f, np.where(reached, np.maximum(H, 0.0), 0.0)  # rounding must not make it negative


def _with_own(H: NDArray[np.float64], log_c: NDArray[np.float64]) -> NDArray[np.float64]:
    """H − log c where a state is possible, else 0."""
    possible = np.isfinite(log_c)
    return H - np.where(possible, log_c, 0.0)


def _log(values: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(divide="ignore"):
        logs: NDArray[np.float64] = np.log(values)
    return logs
