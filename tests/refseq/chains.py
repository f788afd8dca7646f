"""Small chains as dense matrices, and all paths through them: what the chain's structure is held against."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from hypothesis import strategies as st
from scipy.special import logsumexp

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.motion import MotionSettings

if TYPE_CHECKING:
    from hmmlearn.base import BaseHMM

MOTION = MotionSettings()
SPREAD = MotionSettings(0.1, 0.1, 0.02, interpolated=True)
THESIS = ChainSettings()
SETTINGS = (
    THESIS,
    ChainSettings(lost=0.1, relocalisation_range=1.0),
    ChainSettings(lost=0.9, relocalisation_range=50.0, stay_lost=0.2),
    ChainSettings(lost_per_metre=0.3, stay_lost=0.8, lost_at_start=0.1),
    ChainSettings(lost=0.2, kidnap_probability=0.3, relocalisation_range=2.0),
    ChainSettings(lost=0.0, stay_lost=0.0, kidnap_probability=1.0),
    ChainSettings(lost_per_metre=0.1, exit_at_ends=True, kidnap_probability=0.2, relocalisation_range=2.0),
)

# Eighths of a metre are exact, so that edges of windows are hit exactly.
distances = st.integers(-24, 24).map(lambda eighths: eighths / 8)
chain_settings = st.sampled_from(SETTINGS)


def paths(most: int) -> st.SearchStrategy[np.ndarray]:
    """Up to ``most`` places at uneven distances, some of them none at all."""
    return st.lists(st.integers(0, 24), max_size=most - 1).map(lambda gaps: np.cumsum([0, *gaps]) / 8)


def drives(K: int, most: int, likelihood: float, carried: float = 0.0) -> st.SearchStrategy[list[Observation]]:
    """One to ``most`` observations with log-likelihoods to both sides of 0, ``carried`` to at most that probability."""
    logs, places = (
        st.floats(-likelihood, likelihood),
        st.lists(st.floats(-likelihood, likelihood), min_size=K, max_size=K),
    )
    chance = st.just(0.0) | st.floats(0.0, carried)
    observation = st.builds(Observation, distances, places.map(np.array), logs, carried=chance)
    return st.lists(observation, min_size=1, max_size=most)


def dense_window(along: np.ndarray, distance: float, s: MotionSettings, ends: tuple[int, ...] = (-1,)) -> np.ndarray:
    """P(k | j, d) as (j, k), from Fig. 3.7 in words: 1 in the wide bar, ``tail`` in the bars beside it, else 0.

    Where ``interpolated``, the integral of both bars, each half a usual gap narrower, times each place's hat, which is
    1 at the place and falls to 0 at the next ones: both are straight between their corners, so trapezia are exact.
    """
    wide = s.slack + s.drift * abs(distance)
    if s.interpolated:
        return dense_spread(along, distance, max(wide, 0.001), s.tail, ends)
    off = np.abs(along - (along[:, None] + distance))
    window = np.where(off <= wide, 1.0, np.where(off <= wide + abs(distance), s.tail, 0.0))
    return window / window.sum(axis=1, keepdims=True)


def dense_spread(along: np.ndarray, distance: float, wide: float, thin: float, ends: tuple[int, ...]) -> np.ndarray:
    """``dense_window`` with ``interpolated``."""
    K = len(along)
    stops = sorted(end % K + 1 for end in ends)
    gaps = [along[k + 1] - along[k] for k in range(K - 1) if k + 1 not in stops and along[k + 1] > along[k]]
    blur = np.median(gaps) / 2 if gaps else 0.0
    bars = [((1 - thin) * wide, wide), (thin * (wide + abs(distance)), wide + abs(distance))]
    window = np.zeros((K, K))
    for start, stop in zip([0, *stops], stops, strict=False):
        here = along[start:stop]
        for j in range(start, stop):
            for weight, full in bars:
                reach = max(full - blur, 0.001)
                middle = along[j] + distance
                inside = here[np.abs(here - middle) < reach]
                corners = np.array([middle - reach, *inside, middle + reach])
                for k in range(stop - start):
                    # Places without a gap between them share nothing: hats by index, not by position.
                    hat = np.array([share(here, x, side)[k] for x, side in sided(corners)])
                    window[j, start + k] += weight / reach * (np.diff(corners) * (hat[0::2] + hat[1::2]) / 4).sum()
    return window / window.sum(axis=1, keepdims=True)


def sided(corners: np.ndarray) -> list[tuple[float, str]]:
    """Beginning and end of each trapezium: what is seen from its inside."""
    return [pair for a, b in pairwise(corners) for pair in ((float(a), "right"), (float(b), "left"))]


def share(here: np.ndarray, x: float, side: str) -> np.ndarray:
    """The hats of a path's places at ``x``, as seen from that side of it."""
    hats, K = np.zeros(len(here)), len(here)
    after = int(np.searchsorted(here, x, side="right" if side == "right" else "left"))
    if after in (0, K):
        hats[min(after, K - 1)] = 1.0
        return hats
    onward = (x - here[after - 1]) / (here[after] - here[after - 1])
    hats[after - 1], hats[after] = 1 - onward, onward
    return hats


def dense_beyond(chain: Chain, distance: float) -> np.ndarray:
    """Share of the wide bar that lies farther past the end of a place's path than the path's places usually do."""
    K, s = chain.K, chain.motion
    ends = sorted(end % K for end in chain.ends)
    paths = [list(range(first, end + 1)) for first, end in zip([0, *(end + 1 for end in ends)], ends, strict=False)]
    steps = [chain.along[k + 1] - chain.along[k] for path in paths for k in path[:-1]]
    margin = np.median([step for step in steps if step] or [0.0])
    wide, shares = max(s.slack + s.drift * abs(distance), 1e-9), np.zeros(K)
    for path in paths:
        for k in path:
            if distance > 0:
                past = chain.along[k] + distance + wide - chain.along[path[-1]] - margin
            else:
                past = chain.along[path[0]] - margin - chain.along[k] - distance + wide
            shares[k] = min(max(past / (2 * wide), 0), 1) if distance else 0
    return shares


def dense_start(chain: Chain) -> np.ndarray:
    """Probability of each of the 2 K states at the first view: in Lost_0, or at any place alike."""
    K, lost = chain.K, chain.settings.lost_at_start
    return np.concatenate([np.full(K, (1 - lost) / K), [lost], np.zeros(K - 1)])


def dense_carried(chain: Chain) -> np.ndarray:
    """The 2 K × 2 K matrix of a robot that is carried: to any place alike, or lost behind where it was last sure."""
    K, lost = chain.K, chain.settings.lost_at_start
    A = np.zeros((2 * K, 2 * K))
    A[:, :K] = (1 - lost) / K
    ends = {end % K for end in chain.ends}
    for i in range(K):
        A[i, K + (i if i in ends else i + 1)] = A[K + i, K + i] = lost
    return A


def dense_oracle(chain: Chain, distance: float) -> "BaseHMM":
    """hmmlearn's Viterbi over the chain's dense matrix, with log-likelihoods as samples.

    It is imported here: that takes a while, which not every process of a run needs to spend.
    """
    from hmmlearn.base import BaseHMM

    class DenseChain(BaseHMM):
        def _compute_log_likelihood(self, X: np.ndarray) -> np.ndarray:
            return X

    A = dense_transitions(chain, distance)
    oracle = DenseChain(n_components=2 * chain.K, algorithm="viterbi")
    oracle.startprob_, oracle.transmat_ = A[chain.K], A
    return oracle


def dense_transitions(chain: Chain, distance: float) -> np.ndarray:
    """The 2 K × 2 K matrix that the docstring of ``Transitions`` describes, places first."""
    K, s, along = chain.K, chain.settings, chain.along
    lost = 1 - np.exp(-s.lost_per_metre * abs(distance)) if s.lost_per_metre else s.lost
    A = np.zeros((2 * K, 2 * K))
    beyond = dense_beyond(chain, distance) if s.exit_at_ends else np.zeros(K)
    A[:K, :K] = (1 - lost) * (1 - beyond[:, None]) * dense_window(along, distance, chain.motion, chain.ends)
    ends = {end % K for end in chain.ends}
    for i in range(K):
        A[i, K + (i if i in ends else i + 1)] = 1 - (1 - lost) * (1 - beyond[i])
        A[K + i, K + i] = s.stay_lost
        if i == 0:
            A[K, :K] = (1 - s.stay_lost) / K
            continue
        near = np.exp(-np.abs(along - along[i]) / s.relocalisation_range)
        if distance >= 0:
            near[:i] = 0
        A[K + i, :K] = (1 - s.stay_lost) * (1 - s.kidnap_probability) * near / near.sum()
        A[K + i, K] = (1 - s.stay_lost) * s.kidnap_probability
    return A


def log(values: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(values)


def log_likelihoods(observation: Observation, K: int) -> np.ndarray:
    return np.concatenate([observation.places, np.full(K, observation.lost)])


def all_paths(observations: Sequence[Observation], chain: Chain) -> np.ndarray:
    """log P(path, views) of every path from Lost_0: an array with one axis of 2 K states for each view.

    A robot that is carried, with the probability that an observation tells, moves as ``dense_carried`` says.
    """
    scores, K = np.array(0.0), chain.K
    for number, observation in enumerate(observations):
        c = observation.carried
        A = log((1 - c) * dense_transitions(chain, observation.distance) + c * dense_carried(chain))
        way = A if number else log(dense_start(chain))
        scores = scores[..., None] + way + log_likelihoods(observation, K)
    return scores


def marginal(scores: np.ndarray, view: int) -> np.ndarray:
    """P(state at a view | all views), (2 K,), from ``all_paths``."""
    others = tuple(axis for axis in range(scores.ndim) if axis != view)
    logs = logsumexp(scores, axis=others) if others else scores
    return np.exp(logs - logsumexp(logs))
