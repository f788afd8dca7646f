"""From sequences to the map: in which sequence the robot is, P(s), and where in it, P(k_s | s) (4.3, card M1 to M3).

A map of one path answers as its sequence does. Of several, the thesis' profile localises in every sequence by itself
and weighs the answers by how sure each of them is. Ours compares the log-ratios of all places on one scale, and filters
over the network of all paths: P(s) is then nothing but Bayes' rule, and the links carry the belief from one sequence to
the next.
"""

import math
import time
from collections import deque
from collections.abc import Collection, Iterable, Sequence
from dataclasses import fields, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST, Belief, Stage, Timings, belief_from, normalised_entropy
from refseq.inference.chain.chain import Chain, Observation
from refseq.inference.chain.forward import StatePosterior
from refseq.inference.chain.path_filter import path_filter
from refseq.inference.chain.trajectory_entropy import trajectory_entropy
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.profile import Decoder
from refseq.map.sequence import ReferenceSequence
from refseq.map.tracking.stages import ChainTracker, decoded_belief, observed, stage_tracker, with_turns
from refseq.map.tracking.stands import Stands
from refseq.map.tracking.turns_behind import turns_behind


class Tracker(Protocol):
    """One stage over all sequences: their measurements to a belief."""

    def reset(self) -> None:
        """Forget all views seen."""

    def update(self, measured: Sequence[Measurement]) -> Belief:
        """Take the next measurement in every sequence and answer."""


def tracker_for(stage: Stage, map_: Map) -> Tracker:
    """A fresh tracker of a stage, as the map's profile has it; each single view is asked for itself."""
    tracker = _tracker_for(stage, map_)
    return tracker if stage is Stage.UNIFORM else StandingTracker(tracker)


def _tracker_for(stage: Stage, map_: Map) -> Tracker:
    profile = map_.profile
    filters = stage is Stage.CHAIN and profile.by_log_ratios and profile.method.decoding is Decoder.FORWARD
    if filters and not (map_.has_one_path and not len(map_.loops)):
        return NetworkTracker(map_)
    return OnlySequence(stage, map_) if map_.has_one_path else SurestSequence(stage, map_)


class StandingTracker:
    """A tracker to which all views of a robot that stands are one, their mean."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker, self._stands = tracker, Stands()

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()
        self._stands = Stands()

    def update(self, measured: Sequence[Measurement]) -> Belief:
        """Take the next measurement in every sequence and answer."""
        return self._tracker.update(self._stands.mean(measured))


class OnlySequence:
    """The answer of the one sequence that there is."""

    def __init__(self, stage: Stage, map_: Map) -> None:
        self._tracker = stage_tracker(stage, map_.sequence, turns_behind(map_) if stage is Stage.CHAIN else None)

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()

    def update(self, measured: Sequence[Measurement]) -> Belief:
        """Take the next measurement and answer."""
        return self._tracker.update(measured[0])


class SurestSequence:
    """The thesis' way: each sequence answers by itself, and P(s) is how sure it is of its answer (4.5 to 4.8)."""

    def __init__(self, stage: Stage, map_: Map) -> None:
        chained = stage is Stage.CHAIN
        self._answers = [SurePath(s) if chained else SureView(stage, s) for s in map_.sequences]
        self._map = map_

    def reset(self) -> None:
        """Forget all views seen."""
        for answer in self._answers:
            answer.reset()

    def update(self, measured: Sequence[Measurement]) -> Belief:
        """The answers of all sequences, each weighed by its P(s) (4.3)."""
        pairs = [answer.update(one) for answer, one in zip(self._answers, measured, strict=True)]
        beliefs, sure = zip(*pairs, strict=True)
        total = sum(sure)
        weights = [one / total if total > 0 else 1 / len(sure) for one in sure]
        places = np.concatenate([w * belief.places for w, belief in zip(weights, beliefs, strict=True)])
        lost = math.fsum(w * belief.lost for w, belief in zip(weights, beliefs, strict=True))
        number = self._map.sequence_of(int(np.argmax(places)))
        path = tuple(k if k == LOST else k + int(self._map.first[number]) for k in beliefs[number].path)
        timings, after = added_up(belief.timings for belief in beliefs), _weighed_lost(weights, beliefs)
        return belief_from(places, min(lost, 1.0), path=path, timings=timings, lost_after=after)


def _weighed_lost(weights: Sequence[float], beliefs: Sequence[Belief]) -> NDArray[np.float64] | None:
    """The Lost_Places of all sequences, each weighed by its P(s); None where they have none."""
    parts = [w * b.lost_after for w, b in zip(weights, beliefs, strict=True) if b.lost_after is not None]
    return np.concatenate(parts) if parts else None


class SureView:
    """A sequence's answer without the chain, and 1 − H / log K_s, how sure it is (4.5, its sign as the text has it).

    Of one place (4.5) is 0 / 0. It is taken as 0: where there is no choice, its entropy says nothing of the view.
    """

    def __init__(self, stage: Stage, sequence: ReferenceSequence) -> None:
        self._tracker = stage_tracker(stage, sequence)

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()

    def update(self, measured: Measurement) -> tuple[Belief, float]:
        """Belief and sureness."""
        belief = self._tracker.update(measured)
        # Where all places are alike rounding may leave a hair more entropy than there can be.
        return belief, max(0.0, 1 - normalised_entropy(belief.places)) if len(belief.places) > 1 else 0.0


class SurePath:
    """A sequence's answer by the chain, and how sure its trajectory over the last T views is (4.7).

    That is asked of the views alone. The chain's own observations hold the odometer, and so become sure of some place
    on a wrong path as well; and a chain that is sure to be lost is not sure of its path, so no view is the Lost View.
    """

    def __init__(self, sequence: ReferenceSequence) -> None:
        self._sequence, self._tracker = sequence, ChainTracker(sequence)
        self._window = deque[Observation](maxlen=int(sequence.profile.chain.window))

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()
        self._window.clear()

    def update(self, measured: Measurement) -> tuple[Belief, float]:
        """Belief and sureness."""
        start = time.perf_counter()
        observation = self._tracker.observation(measured)
        decoded = self._tracker.decode(observation)
        if measured.log_ratio is None:
            likelihoods = self._sequence.emissions.log_likelihood_of_place(measured.likelihood)
            observation = Observation(measured.distance, *likelihoods)
        if measured.again and self._window:
            self._window.pop()
        self._window.append(observation)
        sure = sureness_of_path(self._window, self._tracker.chain)
        return self._tracker.belief(decoded, replace(measured.timings, chain=time.perf_counter() - start)), sure


def sureness_of_path(window: Collection[Observation], chain: Chain) -> float:
    """1 − H(trajectory | views) / H(trajectory | motion alone), at least 0: (4.7) by what the motion window allows.

    (4.7) divides by log binom(K, T), as if any T of K places made a trajectory. The motion window allows far fewer, so
    that a path of which nothing is known would be nearly half as sure as one that is certain. The entropy that the same
    moves leave before any view counts the allowed ones, each by its probability, and compares paths of all lengths.
    """
    unseen = [Observation(one.distance, np.zeros(chain.K), 0.0) for one in window]
    most = trajectory_entropy(unseen, chain)
    return max(0.0, 1 - trajectory_entropy(window, chain) / most) if most > 0 else 1.0


class NetworkTracker:
    """The forward filter over the network of all paths; P(s) is what the places of a sequence have of the belief."""

    def __init__(self, map_: Map) -> None:
        self.space, self._count = map_.network, len(map_)
        self._filter, self._turns = path_filter(self.space), turns_behind(map_)

    def reset(self) -> None:
        """Forget all views seen."""
        self._filter.reset()
        if self._turns is not None:
            self._turns.reset()

    def update(self, measured: Sequence[Measurement]) -> Belief:
        """Filter the views up to this one."""
        start = time.perf_counter()
        posterior = self._filter.update(self.observation(measured))
        return self.belief(posterior, measured, time.perf_counter() - start)

    def observation(self, measured: Sequence[Measurement]) -> Observation:
        """A measurement as the positions of the network see it."""
        first, log_ratio = measured[0], np.concatenate([one.log_ratio for one in measured if one.log_ratio is not None])
        told = with_turns(self._turns, first, log_ratio[self.space.places])
        return observed(first, told, self.space.settings)

    def belief(self, posterior: StatePosterior, measured: Sequence[Measurement], spent: float = 0.0) -> Belief:
        """The posterior of the positions as a belief about places; to filter it took ``spent`` [s]."""
        at, lost_after = (
            np.asarray(np.bincount(self.space.places, shares, self._count), np.float64)
            for shares in (posterior.places, self.space.chain.lost_after(posterior.lost))
        )
        timings = added_up([Timings(chain=spent), *(one.timings for one in measured)])
        return decoded_belief(replace(posterior, places=at), lost_after, timings)


def added_up(timings: Iterable[Timings]) -> Timings:
    """Sum of the times of several steps."""
    found = list(timings)
    names = [field.name for field in fields(Timings)]
    return Timings(**{name: math.fsum(getattr(one, name) for one in found) for name in names})
