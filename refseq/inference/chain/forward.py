"""Probabilities of all states, summed over all paths: view by view, and in hindsight (card H4).

Everything is kept as logarithms, since views can tell places apart by a factor of e^500 and more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Observation

BAND = 400.0
"""States are moved together while they differ by less than e^400: far from the limits of a float, e^±708."""


class Moves(Protocol):
    """Linear moves of states (2, K) over a distance."""

    @property
    def behind(self) -> NDArray[np.intp]:
        """Number of the Lost_Place behind each place, (K,)."""

    def predict(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probabilities after the move."""

    def backward(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """The transpose of ``predict``."""


class StateSpace(Protocol):
    """States and moves of a filter: a chain, or a network of paths."""

    @property
    def K(self) -> int:
        """Number of places; there are 2 K states."""

    def start(self) -> NDArray[np.float64]:
        """Log-probability of each state at the first view, (2, K)."""

    def transitions(self, distance: float) -> Moves:
        """The moves over a travelled distance [m]."""


@dataclass(frozen=True, slots=True)
class CarriedMoves:
    """The moves of a robot that with a probability of ``carried`` did not make them, but was set down anywhere.

    ``start`` (2, K) are the probabilities of a drive's first view, sum 1. It is at a place with those, whatever it was
    at; or else lost, and it is remembered where it was.
    """

    moves: Moves
    start: NDArray[np.float64]
    carried: float

    @property
    def behind(self) -> NDArray[np.intp]:
        """Number of the Lost_Place behind each place, (K,)."""
        return self.moves.behind

    def predict(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probabilities after the move, with the same sum."""
        places, lost = states
        found, lost_at_start = self.start[0], self.start[1].sum()
        was_at = lost + np.bincount(self.behind, places, len(places))
        came = np.stack([states.sum() * found, lost_at_start * was_at])
        return (1 - self.carried) * self.moves.predict(states) + self.carried * came

    def backward(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """The transpose of ``predict``."""
        places, lost = states
        found, lost_at_start = self.start[0], self.start[1].sum()
        came: NDArray[np.float64] = (places * found).sum() + lost_at_start * np.stack([lost[self.behind], lost])
        return (1 - self.carried) * self.moves.backward(states) + self.carried * came


@dataclass(frozen=True, slots=True)
class StatePosterior:
    """Distribution over the states at a view: places (K,) and Lost_Places (K,), sum 1 over both.

    ``log_evidence`` is log P(view | views before), on the scale of the observation's log-likelihoods.
    """

    places: NDArray[np.float64]
    lost: NDArray[np.float64]
    log_evidence: float


class ForwardFilter:
    """P(state | views up to now), from Lost_0 (3.9): the sum-product beside Viterbi's max-product, without a window."""

    def __init__(self, chain: StateSpace) -> None:
        self._chain = chain
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._log_states: NDArray[np.float64] | None = None
        self._expected: NDArray[np.float64] | None = None

    def update(self, observation: Observation) -> StatePosterior:
        """Take the next view and answer from the views up to it."""
        if self._expected is None or not observation.again:
            self._expected = expected(self._log_states, observation, self._chain)
        self._log_states, log_evidence = weighed(self._expected, observation)
        return _posterior(self._log_states, log_evidence)


def smooth(observations: Sequence[Observation], chain: StateSpace) -> list[StatePosterior]:
    """P(state | all views of the drive) at each view, by the forward-backward recursion.

    It holds all views' states at once, 16 K bytes a view.
    """
    forward: list[tuple[NDArray[np.float64], float]] = []
    for observation in observations:
        before = expected(forward[-1][0] if forward else None, observation, chain)
        forward.append(weighed(before, observation))
    smoothed: list[StatePosterior] = []
    later = np.zeros((2, chain.K))  # log P(later views | state), but for a factor
    for t in reversed(range(len(observations))):
        log_states, log_evidence = forward[t]
        both = log_states + later
        smoothed.append(_posterior(both - _log_sum(both), log_evidence))
        if t:
            later, _ = weighed(later, observations[t])
            later = log_moved(_moves(observations[t], chain).backward, later)
    return smoothed[::-1]


def expected(
    log_states: NDArray[np.float64] | None, observation: Observation, chain: StateSpace
) -> NDArray[np.float64]:
    """Log P(state | views before), (2, K), at an observation.

    ``log_states`` are log P(state | views) at the last one; None: there was none.
    """
    return chain.start() if log_states is None else log_moved(_moves(observation, chain).predict, log_states)


def _moves(observation: Observation, chain: StateSpace) -> Moves:
    """The moves from the last observation to this one."""
    moves = chain.transitions(observation.distance)
    return CarriedMoves(moves, np.exp(chain.start()), observation.carried) if observation.carried > 0 else moves


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
    log_sum = _log_sum(joint)
    joint -= log_sum
    return joint, log_sum


def _log_sum(logs: NDArray[np.float64]) -> float:
    """Log Σ exp(logs)."""
    top = logs.max()
    return float(top + np.log(np.exp(logs - top).sum()))


def _posterior(log_states: NDArray[np.float64], log_evidence: float) -> StatePosterior:
    places, lost = np.exp(log_states)
    return StatePosterior(places, lost, log_evidence)
