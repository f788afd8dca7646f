"""The complete reference sequence: K places, a Lost_Place before each, and the moves between them (card H1, H2).

Scores and probabilities of all states are arrays (2, K): row 0 the places, row 1 the Lost_Places. As one number a
state is k for place k and K + i for Lost_Place i. Nothing here is a matrix of 4 K² transitions: the chain is kept as
its structure, and a step costs O(K log W), where W is how many places the motion window holds, or O(K W) where the
window is interpolated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy

from refseq.inference.chain.discrete_motion import log_of
from refseq.inference.chain.exponential_kernel import ExponentialKernel
from refseq.inference.chain.lost_view import LostView
from refseq.inference.chain.motion import MotionSettings, motion_model
from refseq.inference.paths import PathBounds


class ObservedDistribution(StrEnum):
    """Distributions over the places, of a view that is compared with them, that the chain can observe.

    ``posterior`` is the mixture's under the motion prior, as in Fig. 3.11c: the odometer then counts twice, in that
    prior and in the chain's own moves. ``likelihood`` is the mixture's alone.
    """

    POSTERIOR = "posterior"
    LIKELIHOOD = "likelihood"


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """Parameters of the chain.

    ``lost`` is the probability of going on from a place to the Lost_Place behind it, ``stay_lost`` of staying at a
    Lost_Place; both are 0.5 in (3.5, 3.6). ``lost_at_start`` is that of Lost_0 at the first view, when the robot may be
    at any place else: 0.5 is one move on from (3.9). A robot turns up at a place x [m] from where it got lost with a
    probability that falls as exp(−x / ``relocalisation_range``).

    A ``lost_per_metre`` above 0 takes the place of ``lost``: 1 − exp(−lost_per_metre · |d|) over a distance d, so that
    a path is as easily lost by many short steps as by few long ones. A robot that stands does not get lost then.

    With ``exit_at_ends`` a robot that the odometer puts more than the usual distance of two places past a path's last
    place, or reversing before its first, has left the path: that share of the motion window goes to the Lost_Place.
    Otherwise all that comes to the end of a path stays there.

    With a ``run_out`` above 0 each path goes on for so long behind its end [m] in the forward filter, and looks there
    as its last place does: so a robot that has driven on is not taken for one at the end while that stays in sight.
    With a shorter one it is again sooner; with a longer one a robot that is put there wrongly stays lost for longer.

    ``kidnap_probability`` is the share of a Lost_Place's way out that leads to Lost_0 instead of to near places ahead:
    the robot forgets where it got lost, and may turn up anywhere, as after being carried off or turned round.

    ``carried`` is the probability, before anything is seen, that the robot was carried since the last view. Where what
    its sensors saw of the way makes it more, the robot may by so much be anywhere, as at the first view, or lost behind
    where it was (``Observation.carried``). The forward filter asks it; 0: the robot is never carried.

    ``vague`` is the probability, before a drive, that its views tell little of their places (``VagueFilter``). Filters
    that sum over all paths ask it; 0: views tell what the calibration says.

    ``observation`` is what of a view the chain observes. ``noise`` makes the places' emissions non-zero. ``lost_view``
    says which views are the Lost View: by ``entropy`` those whose distribution over the places has one above
    ``lost_view_entropy`` · log K. A place emits it with probability ``lost_view_at_place``, a Lost_Place with
    ``lost_view_at_lost``, and any view of the sequence alike (3.8); where it is learnt, or none, they are not used.

    The thesis gives only ``lost`` and ``window``, T, the number of observations; the others are choices, and the
    defaults of ``lost_per_metre``, ``exit_at_ends``, ``run_out``, ``kidnap_probability``, ``carried`` and ``vague``
    leave them out.
    """

    window: int = 5
    lost: float = 0.5
    lost_per_metre: float = 0.0
    exit_at_ends: bool = False
    run_out: float = 0.0
    stay_lost: float = 0.5
    lost_at_start: float = 0.5
    kidnap_probability: float = 0.0
    carried: float = 0.0
    vague: float = 0.0
    relocalisation_range: float = 10.0
    observation: ObservedDistribution = ObservedDistribution.POSTERIOR
    noise: float = 0.1
    lost_view: LostView = LostView.ENTROPY
    lost_view_entropy: float = 0.8
    lost_view_at_place: float = 0.1
    lost_view_at_lost: float = 0.5

    def getting_lost(self, distance: float) -> float:
        """Probability of getting lost within ``distance`` [m]."""
        return -math.expm1(-self.lost_per_metre * abs(distance)) if self.lost_per_metre > 0 else self.lost


@dataclass(frozen=True, slots=True)
class Observation:
    """One view as the chain sees it: the distance since the last one [m], and the states' log-likelihoods.

    A ``distance`` that is NaN was not measured. ``places`` is (K,), ``lost`` that of any Lost_Place. Only their
    differences matter, so any scale will do. With ``again`` the robot has stood since the last one, whose place in the
    sequence of observations this one takes. ``carried`` is the probability that it did not come by itself: the filters
    that sum over all paths begin anew with it.
    """

    distance: float
    places: NDArray[np.float64]
    lost: float
    again: bool = False
    carried: float = 0.0


def standing_once(observations: Sequence[Observation]) -> tuple[list[Observation], list[int]]:
    """Observations with one for each stand, its last; and of each that was given the number of its own among them."""
    counted = [one for one, after in pairwise(observations) if not after.again] + list(observations[-1:])
    number = np.cumsum([False, *(not one.again for one in observations[1:])], dtype=np.intp).tolist()
    return counted, number[: len(observations)]


@dataclass(frozen=True)
class Chain:
    """The states over ``along`` (K,), each place's distance along the path [m], rising; and how they are moved between.

    A place is any point of the path: its places may lie closer than the views, and unevenly. Several paths make one
    chain when they are laid so far behind each other that no move reaches from one to the next; ``ends`` are then the
    last places of all of them, rising. Lost_0 is common to all: nothing is known there.
    """

    along: NDArray[np.float64]
    motion: MotionSettings
    settings: ChainSettings
    ends: tuple[int, ...] = (-1,)
    _latest: "dict[float, Transitions]" = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def K(self) -> int:
        """Number of places; there are 2 K states."""
        return len(self.along)

    def start(self) -> NDArray[np.float64]:
        """Log-probability of each state at the first view, (2, K): in Lost_0 (3.9), or found from there already."""
        start = np.full((2, self.K), -np.inf)
        start[0] = log_of((1 - self.settings.lost_at_start) / self.K)
        start[1, 0] = log_of(self.settings.lost_at_start)
        return start

    def transitions(self, distance: float) -> "Transitions":
        """The moves over a travelled distance [m]; negative: the robot reversed; NaN: nobody measured it.

        The last ones made are kept.
        """
        if math.isnan(distance):
            return self.unmeasured.transitions(self._step)
        if distance not in self._latest:
            self._latest.clear()
            self._latest[distance] = Transitions(self, distance)
        return self._latest[distance]

    @cached_property
    def unmeasured(self) -> "Chain":
        """The same chain, with a window for steps of unknown length."""
        return Chain(self.along, self.motion.unmeasured(self._step), self.settings, self.ends)

    @cached_property
    def _step(self) -> float:
        """The usual way from a place to the next of its path [m]."""
        return PathBounds.of(self.along, self.ends).gap

    @cached_property
    def behind(self) -> NDArray[np.intp]:
        """The Lost_Place behind each place, (K,): the next one, or a path's last one behind its last place."""
        ends = np.array(self.ends) % self.K
        behind = np.arange(1, self.K + 1)
        behind[ends] = ends
        return behind

    def lost_after(self, lost: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probability of the Lost_Place behind each place, (K,), from that of each Lost_Place, (K,), without Lost_0.

        A path's last Lost_Place lies behind its last place and behind the one before: it counts for the last one, since
        a path is mostly left at its end.
        """
        after = np.where(self.behind > 0, lost[self.behind], 0.0)
        ends = np.array(self.ends) % self.K
        after[ends[self.behind[ends - 1] == ends] - 1] = 0.0
        return after

    @cached_property
    def kernel(self) -> ExponentialKernel:
        """exp(−distance / ``relocalisation_range``) between places."""
        return ExponentialKernel(self.along, self.settings.relocalisation_range)

    @cached_property
    def log_find_ahead(self) -> NDArray[np.float64]:
        """Log a_ik at no distance for Lost_i → P_k, k ≥ i, (K,)."""
        return self._log_find(self.kernel.after(np.ones(self.K)))

    @cached_property
    def log_find_around(self) -> NDArray[np.float64]:
        """The same for all k, where the robot reverses."""
        return self._log_find(self.kernel.around(np.ones(self.K)))

    def _log_find(self, near: NDArray[np.float64]) -> NDArray[np.float64]:
        find: NDArray[np.float64] = log_of(
            (1 - self.settings.stay_lost) * (1 - self.settings.kidnap_probability)
        ) - np.log(near)
        find[0] = -np.inf  # Lost_0 favours no place
        return find


class Transitions:
    """The moves of the complete reference sequence (3.3 to 3.6), for one travelled distance.

    * P_i → P_k by the motion window, and P_i → Lost_{i+1}, in the shares 1 − ``lost`` and ``lost``. Staying (k = i) is
      allowed, or a standing robot would be lost. No Lost_Place lies behind a path's last place: it leads to the last.
    * Lost_i → Lost_i with probability ``stay_lost``. To other Lost_Places there is no way (3.4), but for the share
      ``kidnap_probability`` of the rest, which leads to Lost_0.
    * Lost_i → P_k for k ≥ i, since Lost_i lies before P_i; nearer ones are likelier, as
      exp(−distance / ``relocalisation_range``).
      A robot that reverses may turn up on either side of P_i: it may have driven on before it turned.
      From Lost_0, where nothing is known, to all places alike (3.3).

    Every row sums to 1. All arrays of states are (2, K); see the module. ``behind`` (K,) is the chain's.
    """

    def __init__(self, chain: Chain, distance: float) -> None:
        settings, self._K, self._kernel = chain.settings, chain.K, chain.kernel
        self.behind = chain.behind
        self._window = motion_model(chain.along, distance, chain.motion, chain.ends)
        self._reversing = distance < 0
        beyond = beyond_ends(chain, distance) if settings.exit_at_ends else np.zeros(chain.K)
        self._go = (1 - settings.getting_lost(distance)) * (1 - beyond)
        self._leave = 1 - self._go
        self._stay = settings.stay_lost
        self._forget = (1 - self._stay) * settings.kidnap_probability
        self._anywhere = (1 - self._stay) / self._K
        with np.errstate(divide="ignore"):
            self._log_go, self._log_leave = np.log(self._go), np.log(self._leave)
        self._log_stay = log_of(self._stay)
        self._log_forget, self._log_anywhere = log_of(self._forget), log_of(self._anywhere)
        # Lost_i → P_k is exp(log_find_i − distance / relocalisation_range).
        self._log_find = chain.log_find_around if self._reversing else chain.log_find_ahead

    def predict(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_i p_i a_ij for every state j: probabilities after the move, with the same sum."""
        places, lost = states
        found = lost * self._find
        moved = np.empty_like(states)
        moved[0] = self._window.predict(self._go * places) + self._anywhere * lost[0]
        moved[0] += self._kernel.around(found) if self._reversing else self._kernel.before(found)
        moved[1] = self._stay * lost + self._shifted(self._leave * places)
        moved[1, 0] += self._forget * lost[1:].sum()
        return moved

    def backward(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j a_ij q_j for every state i: the transpose of ``predict``."""
        places, lost = states
        near = self._kernel.around(places) if self._reversing else self._kernel.after(places)
        moved = np.empty_like(states)
        moved[0] = self._go * self._window.backward(places)
        moved[0] += self._leave * lost[self.behind]
        moved[1] = self._stay * lost + self._find * near
        moved[1, 0] += self._anywhere * places.sum()
        moved[1, 1:] += self._forget * lost[0]
        return moved

    def best(self, scores: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_i score_i + log a_ij for every state j; −∞ where nothing leads."""
        places, lost = scores
        best = np.empty_like(scores)
        best_places, best_lost = best
        np.maximum(self._window.best(places + self._log_go), self._best_found(lost), out=best_places)
        np.add(lost, self._log_stay, out=best_lost)
        np.maximum.at(best_lost, self.behind, places + self._log_leave)
        if self._forget:
            best_lost[0] = max(best_lost[0], lost[1:].max(initial=-np.inf) + self._log_forget)
        return best

    def _best_found(self, lost: NDArray[np.float64]) -> NDArray[np.float64]:
        leaving = lost + self._log_find
        found = self._kernel.best_before(leaving)
        if self._reversing:
            np.maximum(found, self._kernel.best_after(leaving), out=found)
        np.maximum(found, lost[0] + self._log_anywhere, out=found)
        return found

    def predecessors(self, state: int) -> NDArray[np.float64]:
        """Log a_ij of the moves from every state i into the one state j."""
        K, i = self._K, state - self._K
        ways = np.full((2, K), -np.inf)
        if state < K:
            reach, log_window = self._window.predecessors(state)
            ways[0, reach] = log_window + self._log_go[reach]
            near = slice(0, K if self._reversing else state + 1)
            ways[1, near] = self._log_find[near] - np.abs(self._kernel.decay[state] - self._kernel.decay[near])
            ways[1, 0] = self._log_anywhere
            return ways
        if i == 0:
            ways[1] = self._log_forget
        before = self.behind == i
        ways[0, before] = self._log_leave[before]
        ways[1, i] = self._log_stay
        return ways

    def surprise(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_i p_i a_ij (−log a_ij) for every state j: linear in p, as ``predict`` is."""
        places, lost = states
        surprise = np.empty_like(states)
        surprise[0] = self._window.surprise(self._go * places) + self._window.predict(_surprises(self._go) * places)
        surprise[0] += self._surprise_found(lost) + _surprise(self._anywhere) * lost[0]
        surprise[1] = _surprise(self._stay) * lost + self._shifted(_surprises(self._leave) * places)
        surprise[1, 0] += _surprise(self._forget) * lost[1:].sum()
        return np.maximum(surprise, 0.0, out=surprise)  # rounding must not make it negative

    def _surprise_found(self, lost: NDArray[np.float64]) -> NDArray[np.float64]:
        near, found = self._kernel, lost * self._find
        by_source = found * np.where(found > 0, -self._log_find, 0.0)
        if not self._reversing:
            return near.before(by_source) + near.surprise_before(found)
        return near.around(by_source) + near.surprise_before(found) + near.surprise_after(found)

    @cached_property
    def _find(self) -> NDArray[np.float64]:
        find: NDArray[np.float64] = np.exp(self._log_find)
        return find

    def _shifted(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum that comes to each Lost_Place from the places: P_i's to Lost_{i+1}, a path's last one's to its last."""
        return np.asarray(np.bincount(self.behind, places, self._K), np.float64)


def beyond_ends(chain: Chain, distance: float) -> NDArray[np.float64]:
    """Share of each place's high bar that lies past its path's end by more than a usual gap between places, (K,)."""
    if distance == 0:
        return np.zeros(chain.K)
    path = PathBounds.of(chain.along, chain.ends)
    half_width = chain.motion.half_width(distance)
    if distance > 0:
        past = chain.along + distance + half_width - (chain.along[path.last] + path.gap)
    else:
        past = chain.along[path.first] - path.gap - (chain.along + distance - half_width)
    share: NDArray[np.float64] = np.clip(past / max(2 * half_width, 1e-9), 0.0, 1.0)
    return share


def _surprise(probability: float) -> float:
    """−a log a."""
    return -probability * math.log(probability) if probability > 0 else 0.0


def _surprises(probabilities: NDArray[np.float64]) -> NDArray[np.float64]:
    """−a log a."""
    return np.asarray(-xlogy(probabilities, probabilities))
