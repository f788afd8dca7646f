"""Localising views in an atlas: in which sequence the robot is, P(s), and where in it, P(k_s | s) (4.3, card M1 to M3).

The thesis' profile localises in every sequence by itself and weighs the answers by how sure each of them is. Ours
compares what speaks for all places on one scale, and filters over the network of all paths: P(s) is then nothing but
Bayes' rule, and the links carry the belief from one sequence to the next.
"""

import math
import time
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from refseq.atlas.atlas import Atlas
from refseq.belief import Belief, Stage, Timings, belief_from, normalised_entropy
from refseq.features import Observed
from refseq.inference.chain.chain import Chain, Observation
from refseq.inference.chain.forward import ForwardFilter
from refseq.inference.chain.trajectory import trajectory_entropy
from refseq.map.localiser import ChainTracker, Matcher, Sighting, decoded_belief, tracker_for
from refseq.map.profile import Decoder, Matching
from refseq.map.sequence import ReferenceSequence
from refseq.view import View


class AtlasMatcher:
    """Views to a sighting for each sequence; what all need of a view is described once."""

    def __init__(self, atlas: Atlas, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        self._matchers = [Matcher(sequence, sensors=sensors, seed=seed) for sequence in atlas.sequences]

    def reset(self) -> None:
        """Forget all views seen."""
        for matcher in self._matchers:
            matcher.reset()

    def match(self, view: View) -> list[Sighting]:
        """Compare a view with the places of every sequence."""
        start = time.perf_counter()
        described = {e.key: e.describe(view) for e in self._matchers[0].extractors if e.sensor in view.sensors}
        spent = time.perf_counter() - start
        sightings = []
        for matcher in self._matchers:
            start = time.perf_counter()
            known = {e.key: e for e in matcher.extractors}
            observed = {key: Observed(known[key].recognise(seen), 0.0) for key, seen in described.items()}
            found = time.perf_counter() - start
            sighting = matcher.compare(observed, view.distance)
            timings = Timings(features=spent, matching=found, mixture=sighting.timings.mixture)
            sightings.append(replace(sighting, timings=timings))
            spent = 0.0  # the first one's
        return sightings


class AtlasLocaliser:
    """Finds each view's place in an atlas: reset, then one update a view.

    A belief's ``places`` are those of all sequences one behind the other, given that the robot is at any of them;
    ``lost`` is the probability that it is in none. ``of_sequences`` says how the belief is shared out among them.
    Raises ``MapError`` for a sensor that the maps do not have.
    """

    def __init__(
        self,
        atlas: Atlas,
        *,
        stage: Stage = Stage.CHAIN,
        sensors: Sequence[str] | None = None,
        seed: int = 0,
    ) -> None:
        self._matcher = AtlasMatcher(atlas, sensors=sensors, seed=seed)
        self._tracker = atlas_tracker(stage, atlas)

    def reset(self) -> None:
        """Forget all views seen."""
        self._matcher.reset()
        self._tracker.reset()

    def update(self, view: View) -> Belief:
        """Take the next view and answer from the views up to it."""
        return self._tracker.update(self._matcher.match(view))


def localise_in(
    atlas: Atlas,
    views: Iterable[View],
    *,
    stages: Sequence[Stage] = tuple(Stage),
    sensors: Sequence[str] | None = None,
    seed: int = 0,
) -> Mapping[Stage, list[Belief]]:
    """Localise a whole drive in an atlas at several stages; each view is matched once for all of them.

    ``sensors`` is a subset of the maps' (default: all). Raises ``MapError`` for a sensor that they do not have.
    """
    matcher = AtlasMatcher(atlas, sensors=sensors, seed=seed)
    trackers = {stage: atlas_tracker(stage, atlas) for stage in stages}
    beliefs: dict[Stage, list[Belief]] = {stage: [] for stage in stages}
    for view in views:
        sightings = matcher.match(view)
        for stage, tracker in trackers.items():
            beliefs[stage].append(tracker.update(sightings))
    return beliefs


def of_sequences(atlas: Atlas, belief: Belief) -> NDArray[np.float64]:
    """P(s), (S,), given that the robot is in any of the sequences: what their places have of a belief, sum 1."""
    shares: NDArray[np.float64] = np.add.reduceat(belief.places, atlas.first[:-1])
    return shares


class AtlasTracker(Protocol):
    """One stage over all sequences: their sightings to a belief."""

    def reset(self) -> None:
        """Forget all views seen."""

    def update(self, sightings: Sequence[Sighting]) -> Belief:
        """Take the next sighting in every sequence and answer."""


def atlas_tracker(stage: Stage, atlas: Atlas) -> AtlasTracker:
    """A fresh tracker of a stage, as the profile of the maps has it."""
    method = atlas.sequences[0].profile.method
    if stage is Stage.CHAIN and method.matching is Matching.LOG_RATIO and method.decoding is Decoder.FORWARD:
        return NetworkTracker(atlas)
    return SurestSequence(stage, atlas)


class SurestSequence:
    """The thesis' way: each sequence answers by itself, and P(s) is how sure it is of its answer (4.5 to 4.8)."""

    def __init__(self, stage: Stage, atlas: Atlas) -> None:
        chained = stage is Stage.CHAIN
        self._answers = [SurePath(s) if chained else SureView(stage, s) for s in atlas.sequences]

    def reset(self) -> None:
        """Forget all views seen."""
        for answer in self._answers:
            answer.reset()

    def update(self, sightings: Sequence[Sighting]) -> Belief:
        """The answers of all sequences, each weighed by its P(s) (4.3)."""
        pairs = [answer.update(sighting) for answer, sighting in zip(self._answers, sightings, strict=True)]
        beliefs, sure = zip(*pairs, strict=True)
        total = sum(sure)
        weights = [one / total if total > 0 else 1 / len(sure) for one in sure]
        places = np.concatenate([w * belief.places for w, belief in zip(weights, beliefs, strict=True)])
        lost = math.fsum(w * belief.lost for w, belief in zip(weights, beliefs, strict=True))
        return belief_from(places, min(lost, 1.0), timings=added_up(belief.timings for belief in beliefs))


class SureView:
    """A sequence's answer without the chain, and 1 − H / log K_s, how sure it is (4.5, its sign as the text has it)."""

    def __init__(self, stage: Stage, sequence: ReferenceSequence) -> None:
        self._tracker = tracker_for(stage, sequence)

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()

    def update(self, sighting: Sighting) -> tuple[Belief, float]:
        """Belief and sureness."""
        belief = self._tracker.update(sighting)
        # Where all places are alike rounding may leave a hair more entropy than there can be.
        return belief, max(0.0, 1 - normalised_entropy(belief.places))


class SurePath:
    """A sequence's answer by the chain, and 1 − H(trajectory) / log binom(K_s, T) over the last T views (4.7)."""

    def __init__(self, sequence: ReferenceSequence) -> None:
        self._tracker = ChainTracker(sequence)
        self._window = deque[Observation](maxlen=int(sequence.profile.chain.window))

    def reset(self) -> None:
        """Forget all views seen."""
        self._tracker.reset()
        self._window.clear()

    def update(self, sighting: Sighting) -> tuple[Belief, float]:
        """Belief and sureness."""
        start = time.perf_counter()
        observation = self._tracker.observation(sighting)
        self._window.append(observation)
        decoded = self._tracker.decode(observation)
        sure = sureness_of_path(self._window, self._tracker.chain)
        return decoded_belief(decoded, replace(sighting.timings, chain=time.perf_counter() - start)), sure


def sureness_of_path(window: Collection[Observation], chain: Chain) -> float:
    """1 − H(trajectory | views) / log binom(K, T) for T views (4.7), at least 0.

    The normaliser counts the ways to choose T of K places, so that paths of all lengths compare. There are more
    trajectories than that, through Lost_Places and standing still: what is as unsure as that is simply not sure. Where
    there is one way or none, K ≤ T, it is that for half as many.
    """
    T = min(len(window), max(chain.K // 2, 1))
    ways = float(gammaln(chain.K + 1) - gammaln(T + 1) - gammaln(chain.K - T + 1))
    if ways <= 0:
        return 1.0
    return max(0.0, 1 - trajectory_entropy(window, chain) / ways)


class NetworkTracker:
    """The forward filter over the network of all paths; P(s) is what the places of a sequence have of the belief."""

    def __init__(self, atlas: Atlas) -> None:
        self._network, self._count = atlas.network, len(atlas)
        self._filter = ForwardFilter(self._network)

    def reset(self) -> None:
        """Forget all views seen."""
        self._filter.reset()

    def update(self, sightings: Sequence[Sighting]) -> Belief:
        """Filter the views up to this one."""
        start = time.perf_counter()
        places = self._network.places
        evidence = np.concatenate([s.log_evidence for s in sightings if s.log_evidence is not None])
        posterior = self._filter.update(Observation(sightings[0].distance, evidence[places], 0.0))
        at = np.asarray(np.bincount(places, posterior.places, self._count), np.float64)
        spent = Timings(chain=time.perf_counter() - start)
        timings = added_up([spent, *(sighting.timings for sighting in sightings)])
        return decoded_belief(replace(posterior, places=at), timings)


def added_up(timings: Iterable[Timings]) -> Timings:
    """What steps took in all."""
    found = list(timings)
    names = [field.name for field in fields(Timings)]
    return Timings(**{name: math.fsum(getattr(one, name) for one in found) for name in names})
