"""Localising views in a reference sequence, at any of the thesis' three stages."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, logsumexp, softmax

from refseq.belief import LOST, LOST_ABOVE, Belief, Stage, Timings, entropy
from refseq.errors import MapError
from refseq.features import Observed
from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.forward import ForwardFilter, StatePosterior, smooth
from refseq.inference.chain.motion import motion_prior
from refseq.inference.chain.viterbi import Decoding, SlidingViterbi
from refseq.map.profile import Decoder, Matching
from refseq.map.sequence import ReferenceSequence
from refseq.view import View


class SequenceLocaliser:
    """Finds each view's place in a reference sequence: reset, then one update a view.

    ``stage`` is how much context is used, ``sensors`` a subset of the map's (default: all). A view that lacks a sensor
    is matched by the others. The same views with the same ``seed`` give the same beliefs, bit for bit.

    Raises ``MapError`` for a sensor that the map does not have.
    """

    def __init__(
        self,
        sequence: ReferenceSequence,
        *,
        stage: Stage = Stage.CHAIN,
        sensors: Sequence[str] | None = None,
        seed: int = 0,
    ) -> None:
        self._matcher = Matcher(sequence, sensors=sensors, seed=seed)
        self._tracker = tracker_for(stage, sequence)

    def reset(self) -> None:
        """Forget all views seen."""
        self._matcher.reset()
        self._tracker.reset()

    def update(self, view: View) -> Belief:
        """Take the next view and answer from the views up to it."""
        return self._tracker.update(self._matcher.match(view))


def localise(
    sequence: ReferenceSequence,
    views: Iterable[View],
    *,
    stages: Sequence[Stage] = tuple(Stage),
    sensors: Sequence[str] | None = None,
    seed: int = 0,
) -> Mapping[Stage, list[Belief]]:
    """Localise a whole drive at several stages; each view is matched once for all of them."""
    matcher = Matcher(sequence, sensors=sensors, seed=seed)
    trackers = {stage: tracker_for(stage, sequence) for stage in stages}
    beliefs: dict[Stage, list[Belief]] = {stage: [] for stage in stages}
    for view in views:
        sighting = matcher.match(view)
        for stage, tracker in trackers.items():
            beliefs[stage].append(tracker.update(sighting))
    return beliefs


def smoothed(
    sequence: ReferenceSequence, views: Iterable[View], *, sensors: Sequence[str] | None = None, seed: int = 0
) -> list[Belief]:
    """The chain's answers in hindsight: each view's in the light of the whole drive, those after it among them.

    They are not what a robot could have known on its way, and are scored apart. The chain is that of the sequence's
    profile, summed over all paths (``forward.smooth``) whatever its decoding.
    """
    matcher = Matcher(sequence, sensors=sensors, seed=seed)
    tracker = ChainTracker(sequence)
    sightings = [matcher.match(view) for view in views]
    posteriors = smooth([tracker.observation(sighting) for sighting in sightings], tracker.chain)
    return [decoded_belief(*pair) for pair in zip(posteriors, (s.timings for s in sightings), strict=True)]


@dataclass(frozen=True, slots=True)
class Sighting:
    """A view after matching: the likelihood of each place (K,), sum 1; the motion since the last view [m]; the cost.

    ``log_evidence`` (K,) says what speaks for each place against being elsewhere, ``None`` where the matching does not
    tell; the likelihood is then the same but for a factor.
    """

    likelihood: NDArray[np.float64]
    distance: float
    timings: Timings
    log_evidence: NDArray[np.float64] | None = None


class Matcher:
    """Views to likelihoods over places: features, their matching, and the mixture or the evidence."""

    def __init__(self, sequence: ReferenceSequence, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        wanted = sequence.sensors if sensors is None else frozenset(sensors)
        check_among(wanted, sequence.sensors)
        self.sequence = sequence
        self.extractors = tuple(e for e in sequence.extractors if e.sensor in wanted)
        self._seed = seed
        self._count = 0

    def reset(self) -> None:
        """Start counting views anew; the count is part of the seed."""
        self._count = 0

    def match(self, view: View) -> Sighting:
        """Compare a view with all places."""
        return self.compare(self.observe(view), view.distance)

    def observe(self, view: View) -> Mapping[str, Observed]:
        """The known features that a view shows, by extractor; one whose sensor is away is left out."""
        return {e.key: e.observe(view) for e in self.extractors if e.sensor in view.sensors}

    def compare(self, observed: Mapping[str, Observed], distance: float) -> Sighting:
        """Compare the features of a view, ``distance`` [m] after the last one, with all places."""
        start = time.perf_counter()
        log_evidence = None
        if self.sequence.profile.method.matching is Matching.LOG_RATIO:
            log_evidence = self.sequence.log_ratio_model.log_ratios({key: seen.ids for key, seen in observed.items()})
            likelihood = softmax(log_evidence)
        else:
            blocks = self.sequence.matrix.blocks
            rows = [blocks[key].start + seen.ids for key, seen in observed.items()]
            ids = np.concatenate([*rows, np.zeros(0, np.intp)])
            likelihood = self.sequence.match(ids, (self._seed, self._count)).likelihood
        timings = Timings(
            features=sum(seen.extraction for seen in observed.values()),
            matching=sum(seen.matching for seen in observed.values()),
            mixture=time.perf_counter() - start,
        )
        self._count += 1
        return Sighting(likelihood, distance, timings, log_evidence)


def check_among(wanted: Iterable[str], there: Iterable[str]) -> None:
    """Raise ``MapError`` for the first sensor wanted that the map does not have."""
    known = sorted(there)
    for sensor in sorted(set(wanted)):
        if sensor not in known:
            raise MapError(f"sensor {sensor!r} is not in the map; valid are {', '.join(known)}")


class Tracker(Protocol):
    """One stage: sightings to beliefs."""

    def reset(self) -> None:
        """Forget all views seen."""

    def update(self, sighting: Sighting) -> Belief:
        """Take the next sighting and answer."""


def tracker_for(stage: Stage, sequence: ReferenceSequence) -> Tracker:
    """A fresh tracker of a stage."""
    match stage:
        case Stage.UNIFORM:
            return SingleView(sequence.profile.chain.lost_at_start)
        case Stage.PRIOR:
            return MotionFilter(sequence)
        case Stage.CHAIN:
            return ChainTracker(sequence)


class SingleView:
    """The posterior under a uniform prior, each view for itself."""

    def __init__(self, lost_at_start: float) -> None:
        self._lost_at_start = lost_at_start

    def reset(self) -> None:
        """Nothing is kept."""

    def update(self, sighting: Sighting) -> Belief:
        """The likelihood itself; with evidence, being lost is as probable before the view as at a drive's start."""
        belief = posterior_belief(sighting.likelihood, sighting.timings)
        if sighting.log_evidence is None:
            return belief
        return replace(belief, lost=float(expit(logit(self._lost_at_start) - log_mean(sighting.log_evidence))))


def log_mean(log_values: NDArray[np.float64]) -> float:
    """Logarithm of the mean of numbers given by their logarithms."""
    return float(logsumexp(log_values) - np.log(len(log_values)))


class MotionFilter:
    """The mixture's posterior under the motion prior: the last posterior, moved by the odometer (2.17)."""

    def __init__(self, sequence: ReferenceSequence) -> None:
        self._along = sequence.along
        self._settings = sequence.profile.motion
        self._last: NDArray[np.float64] | None = None

    def reset(self) -> None:
        """The next prior is uniform."""
        self._last = None

    def update(self, sighting: Sighting) -> Belief:
        """Prior times likelihood, normalised (2.12)."""
        posterior = sighting.likelihood
        if self._last is not None:
            prior = motion_prior(self._last, self._along, sighting.distance, self._settings)
            posterior = under_prior(posterior, prior)
        self._last = posterior
        return posterior_belief(posterior, sighting.timings)


def under_prior(likelihood: NDArray[np.float64], prior: NDArray[np.float64]) -> NDArray[np.float64]:
    """StatePosterior of a likelihood under a prior (2.12), (K,)."""
    joint = likelihood * prior
    posterior: NDArray[np.float64] = joint / joint.sum()
    return posterior


def posterior_belief(posterior: NDArray[np.float64], timings: Timings) -> Belief:
    """The belief of a posterior alone.

    The mixture has no Lost_Place: it says lost only where it knows nothing at all, as after a view without features.
    """
    best = int(np.argmax(posterior))
    lost = float(np.ptp(posterior) == 0 and len(posterior) > 1)
    return Belief(posterior, lost, best, (best,), entropy(posterior), timings)


class ChainTracker:
    """The hidden Markov chain (H1 to H4), decoded as the profile says, from the views up to now.

    Over the mixture it observes, as in Fig. 3.11c, the posterior under the motion prior, not the bare likelihood. That
    prior must not come from the chain's own answer: a wrong answer would then confirm itself. Evidence needs no such
    detour: it is a likelihood of the places and of being lost already. ``settings`` are by default the profile's.
    """

    def __init__(self, sequence: ReferenceSequence, settings: ChainSettings | None = None) -> None:
        profile = sequence.profile
        self.chain = Chain(sequence.along, profile.motion, settings or profile.chain)
        self._filter = MotionFilter(sequence)
        self._sequence = sequence
        forward = profile.method.decoding is Decoder.FORWARD
        self._decoder = ForwardFilter(self.chain) if forward else SlidingViterbi(self.chain)

    def reset(self) -> None:
        """Forget all views seen."""
        self._filter.reset()
        self._decoder.reset()

    def update(self, sighting: Sighting) -> Belief:
        """Decode the views up to this sighting."""
        start = time.perf_counter()
        decoded = self.decode(self.observation(sighting))
        return decoded_belief(decoded, replace(sighting.timings, chain=time.perf_counter() - start))

    def decode(self, observation: Observation) -> Decoding | StatePosterior:
        """Take the next view as the chain sees it."""
        return self._decoder.update(observation)

    def observation(self, sighting: Sighting) -> Observation:
        """A sighting as the chain sees it."""
        if sighting.log_evidence is not None:
            return Observation(sighting.distance, sighting.log_evidence, 0.0)
        places, lost = self._sequence.emissions.log_likelihood(self._filter.update(sighting).places)
        return Observation(sighting.distance, places, lost)


def decoded_belief(decoded: Decoding | StatePosterior, timings: Timings) -> Belief:
    """The chain's answer as a belief: places given that the robot is at one, and the share of the Lost_Places.

    The forward filter knows no best path; its path is the best state of the view alone.
    """
    on_path = float(decoded.places.sum())
    K = len(decoded.places)
    places = decoded.places / on_path if on_path > 0 else np.full(K, 1 / K)
    # A rounding error must not make the probability negative.
    lost = min(1.0, max(0.0, 1.0 - on_path))
    best = int(np.argmax(places))
    if isinstance(decoded, Decoding):
        path = tuple(state if state < K else LOST for state in decoded.path)
    else:
        path = (best if lost <= LOST_ABOVE else LOST,)
    return Belief(places, lost, best, path, entropy(places), timings)
