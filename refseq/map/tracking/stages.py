"""The thesis' three stages over one reference sequence: a single view, the motion prior, the hidden Markov chain."""

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, logsumexp

from refseq.belief import LOST, LOST_ABOVE, Belief, Stage, Timings, entropy
from refseq.inference.chain.chain import Chain, ChainSettings, Observation, ObservedDistribution
from refseq.inference.chain.emissions import Seen
from refseq.inference.chain.forward import StatePosterior
from refseq.inference.chain.motion import motion_prior
from refseq.inference.chain.path_filter import path_filter
from refseq.inference.chain.viterbi import Decoding, SlidingViterbi
from refseq.map.matcher import Measurement
from refseq.map.profile import Decoder
from refseq.map.sequence import ReferenceSequence
from refseq.map.tracking.turns_behind import TurnsBehind


def stage_tracker(
    stage: Stage, sequence: ReferenceSequence, turns: TurnsBehind | None = None
) -> "SingleView | MotionFilter | ChainTracker":
    """A fresh tracker of a stage; ``turns`` are asked by the chain."""
    match stage:
        case Stage.UNIFORM:
            return SingleView(sequence.profile.chain.lost_at_start)
        case Stage.PRIOR:
            return MotionFilter(sequence)
        case Stage.CHAIN:
            return ChainTracker(sequence, turns=turns)


class SingleView:
    """The posterior under a uniform prior, each view for itself."""

    def __init__(self, lost_at_start: float) -> None:
        self._lost_at_start = lost_at_start

    def reset(self) -> None:
        """Nothing is kept."""

    def update(self, measured: Measurement) -> Belief:
        """The likelihood itself; with log-ratios, being lost is as probable before the view as at a drive's start."""
        belief = posterior_belief(measured.likelihood, measured.timings)
        if measured.log_ratio is None:
            return belief
        return replace(belief, lost=float(expit(logit(self._lost_at_start) - log_mean(measured.log_ratio))))


def log_mean(log_values: NDArray[np.float64]) -> float:
    """Logarithm of the mean of numbers given by their logarithms."""
    return float(logsumexp(log_values) - np.log(len(log_values)))


class MotionFilter:
    """The mixture's posterior under the motion prior: the last posterior, moved by the odometer (2.17)."""

    def __init__(self, sequence: ReferenceSequence) -> None:
        self._along = sequence.along
        self._settings = sequence.profile.motion
        self._last: NDArray[np.float64] | None = None
        self._prior: NDArray[np.float64] | None = None

    def reset(self) -> None:
        """The next prior is uniform."""
        self._last = self._prior = None

    def update(self, measured: Measurement) -> Belief:
        """Prior times likelihood, normalised (2.12)."""
        posterior, _ = self.filter(measured)
        return posterior_belief(posterior, measured.timings)

    def filter(self, measured: Measurement) -> tuple[NDArray[np.float64], float]:
        """The posterior (K,), and the view's evidence Σ_k L(k) P(k): 1 / K under a uniform prior."""
        posterior, evidence = measured.likelihood, 1 / len(self._along)
        if self._last is not None and not measured.again:
            self._prior = motion_prior(self._last, self._along, measured.distance, self._settings)
        if self._prior is not None:
            posterior, evidence = under_prior(posterior, self._prior)
        self._last = posterior
        return posterior, evidence


def under_prior(likelihood: NDArray[np.float64], prior: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Posterior of a likelihood under a prior (2.12), (K,), and the sum that it was divided by.

    Where the view rules out all that the prior allows, one of them is wrong: the view begins anew, as a drive's first.
    """
    joint = likelihood * prior
    evidence = float(joint.sum())
    return (joint / evidence, evidence) if evidence > 0 else (likelihood, 1 / len(likelihood))


def posterior_belief(posterior: NDArray[np.float64], timings: Timings) -> Belief:
    """The belief of a posterior alone.

    The mixture has no Lost_Place: it says lost only where it knows nothing at all, as after a view without features.
    """
    best = int(np.argmax(posterior))
    lost = float(np.ptp(posterior) == 0 and len(posterior) > 1)
    return Belief(posterior, lost, best, (best,), entropy(posterior), timings)


class ChainTracker:
    """The hidden Markov chain (H1 to H4), decoded as the profile says, from the views up to now.

    Over the mixture it observes what ``chain.observation`` says, as in Fig. 3.11c the posterior under the motion prior.
    That prior must not come from the chain's own answer: a wrong answer would then confirm itself. Log-ratios need
    no such detour: they weigh the places against being lost already, and with ``turns`` the way behind weighs them too.
    ``settings`` are by default the profile's.
    """

    def __init__(
        self, sequence: ReferenceSequence, settings: ChainSettings | None = None, *, turns: TurnsBehind | None = None
    ) -> None:
        profile = sequence.profile
        self.chain = Chain(sequence.along, profile.motion, settings or profile.chain)
        self._filter = MotionFilter(sequence)
        self._sequence, self._turns = sequence, turns
        forward = profile.method.decoding is Decoder.FORWARD
        self._decoder = path_filter(self.chain) if forward else SlidingViterbi(self.chain)

    def reset(self) -> None:
        """Forget all views seen."""
        self._filter.reset()
        self._decoder.reset()
        if self._turns is not None:
            self._turns.reset()

    def update(self, measured: Measurement) -> Belief:
        """Decode the views up to this one."""
        start = time.perf_counter()
        decoded = self.decode(self.observation(measured))
        return self.belief(decoded, replace(measured.timings, chain=time.perf_counter() - start))

    def belief(self, decoded: Decoding | StatePosterior, timings: Timings) -> Belief:
        """The decoded path and its probabilities, as a belief."""
        return decoded_belief(decoded, self.chain.lost_after(decoded.lost), timings)

    def decode(self, observation: Observation) -> Decoding | StatePosterior:
        """Take the next view as the chain sees it."""
        return self._decoder.update(observation)

    def observation(self, measured: Measurement) -> Observation:
        """A measurement as the chain sees it."""
        if measured.log_ratio is not None:
            log_ratio = with_turns(self._turns, measured, measured.log_ratio)
            return observed(measured, log_ratio, self.chain.settings)
        places, lost = self._sequence.emissions.log_likelihood(self._seen(measured))
        return Observation(measured.distance, places, lost, measured.again)

    def _seen(self, measured: Measurement) -> Seen:
        if self.chain.settings.observation is ObservedDistribution.LIKELIHOOD:
            return Seen(measured.likelihood, measured.likelihood, measured.log_average)
        posterior, evidence = self._filter.filter(measured)
        # The average features are as likely as before; the places, where the robot is expected, more than on average.
        log_average = measured.log_average - math.log(evidence * len(posterior))
        return Seen(posterior, measured.likelihood, log_average)


def observed(measured: Measurement, log_ratio: NDArray[np.float64], settings: ChainSettings) -> Observation:
    """A measurement as a chain sees it whose positions have these log ratios (K,).

    ``carried`` is by how much the sensors make it more probable than ``settings.carried`` that the robot was carried: 0
    where they tell nothing, as the chain has its own ways of getting lost.
    """
    carried = 0.0
    if measured.log_ratio_carried > 0:
        carried = float(expit(measured.log_odds_carried(settings.carried))) - settings.carried
    return Observation(measured.distance, log_ratio, 0.0, measured.again, carried)


def with_turns(turns: TurnsBehind | None, measured: Measurement, log_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log ratios of positions (K,) with what the way behind tells of them."""
    if turns is None:
        return log_ratio
    return log_ratio + turns.log_ratios(measured.distance, measured.turn, again=measured.again)


def decoded_belief(decoded: Decoding | StatePosterior, lost_after: NDArray[np.float64], timings: Timings) -> Belief:
    """The chain's answer as a belief: places given that the robot is at one, and the share of the Lost_Places.

    ``lost_after`` (K,) are the Lost_Places, each by the place that it lies behind (``Chain.lost_after``). The forward
    filter knows no best path; its path is the best state of the view alone.
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
    return Belief(places, lost, best, path, entropy(places), timings, lost_after=lost_after)
