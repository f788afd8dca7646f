import itertools
import math

import numpy as np
import pytest
from hmmlearn.base import BaseHMM
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.chain import (
    ChainSettings,
    Decoding,
    Emissions,
    Observation,
    Transitions,
    entropy,
    is_lost_view,
    normalised_entropy,
    viterbi,
)
from refseq.motion import MotionSettings
from tests.refseq.test_motion import dense_window

quick = settings(deadline=None, max_examples=120, derandomize=True)
MOTION = MotionSettings()
CHAIN = ChainSettings()


def paths(most: int) -> st.SearchStrategy[np.ndarray]:
    return st.lists(st.integers(0, 24), max_size=most - 1).map(lambda gaps: np.cumsum([0, *gaps]) / 8)


distances = st.integers(-24, 24).map(lambda eighths: eighths / 8)
chain_settings = st.sampled_from([CHAIN, ChainSettings(lost=0.1, near=1.0), ChainSettings(lost=0.9, near=50.0)])


def dense_transitions(along: np.ndarray, distance: float, motion: MotionSettings, s: ChainSettings) -> np.ndarray:
    """The 2K × 2K matrix that the docstring of ``Transitions`` describes, places first."""
    K = len(along)
    A = np.zeros((2 * K, 2 * K))
    window = dense_window(along, distance, motion)
    for i in range(K):
        next_lost = K + min(i + 1, K - 1)
        if window[i].any():
            A[i, :K] = (1 - s.lost) * window[i]
            A[i, next_lost] = s.lost
        else:
            A[i, next_lost] = 1.0
        A[K + i, K + i] = s.lost
        found = np.zeros(K)
        found[i:] = np.exp(-(along[i:] - along[i]) / s.near) if i else 1.0
        A[K + i, :K] = (1 - s.lost) * found / found.sum()
    return A


def log(values: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(values)


@quick
@given(paths(6), distances, chain_settings, st.data())
def test_best_is_the_dense_maximum(along: np.ndarray, distance: float, s: ChainSettings, data: st.DataObject) -> None:
    K = len(along)
    A = dense_transitions(along, distance, MOTION, s)
    np.testing.assert_allclose(A.sum(axis=1), 1.0)
    value = st.one_of(st.floats(-9, 0), st.just(-np.inf))
    score = np.array(data.draw(st.lists(value, min_size=2 * K, max_size=2 * K)))
    ways = score[:, None] + log(A)
    step = Transitions(along, distance, MOTION, s).best(score[:K], score[K:])
    best = np.concatenate([step.places, step.lost])
    source = np.concatenate([step.places_from, step.lost_from])
    np.testing.assert_allclose(best, ways.max(axis=0), atol=1e-10)
    reached = np.isfinite(best)
    np.testing.assert_allclose(ways[source, np.arange(2 * K)][reached], best[reached], atol=1e-10)


@quick
@given(paths(6), distances, chain_settings)
def test_rows_sum_to_one(along: np.ndarray, distance: float, s: ChainSettings) -> None:
    """Each row is read back from ``best`` alone: from one state, the best way is the only one."""
    K = len(along)
    transitions = Transitions(along, distance, MOTION, s)
    for state in range(2 * K):
        score = np.where(np.arange(2 * K) == state, 0.0, -np.inf)
        step = transitions.best(score[:K], score[K:])
        assert np.exp(step.places).sum() + np.exp(step.lost).sum() == pytest.approx(1.0)


def log_emissions(observation: Observation, K: int) -> np.ndarray:
    return np.concatenate([observation.places, np.full(K, observation.lost)])


def brute_force(
    observations: list[Observation], along: np.ndarray, s: ChainSettings
) -> tuple[np.ndarray, list[tuple[float, tuple[int, ...]]]]:
    """Best score of each last state, and all paths with their scores."""
    K = len(along)
    best = np.full(2 * K, -np.inf)
    steps = [log(dense_transitions(along, o.distance, MOTION, s)) for o in observations]
    scored = []
    for states in itertools.product(range(2 * K), repeat=len(observations)):
        score, before = 0.0, K  # Lost_0
        for A, observation, state in zip(steps, observations, states, strict=True):
            score += A[before, state] + log_emissions(observation, K)[state]
            before = state
        best[before] = max(best[before], score)
        scored.append((score, states))
    return best, scored


def assert_decodes(decoding: Decoding, best: np.ndarray) -> None:
    weights = np.exp(best - best.max())
    np.testing.assert_allclose(np.concatenate([decoding.places, decoding.lost]), weights / weights.sum(), atol=1e-9)


log_likelihoods = st.floats(-6, 0)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(paths(3), chain_settings, st.data())
def test_viterbi_is_the_best_of_all_paths(along: np.ndarray, s: ChainSettings, data: st.DataObject) -> None:
    K, T = len(along), data.draw(st.integers(1, 4 if len(along) < 3 else 3))
    places = st.lists(log_likelihoods, min_size=K, max_size=K).map(np.array)
    observations = [Observation(data.draw(distances), data.draw(places), data.draw(log_likelihoods)) for _ in range(T)]
    decoding = viterbi(observations, along, MOTION, s)
    best, scored = brute_force(observations, along, s)
    assert_decodes(decoding, best)
    # Rounding may choose among equals, so the path's own score is compared.
    assert {states: score for score, states in scored}[decoding.path] == pytest.approx(max(scored)[0])


def test_viterbi_is_the_best_of_all_paths_of_four_places_and_four_views() -> None:
    rng, along = np.random.default_rng(2), np.array([0.0, 0.8, 2.0, 2.9])
    observations = [Observation(0.9, rng.normal(size=4), float(rng.normal())) for _ in range(4)]
    decoding = viterbi(observations, along, MOTION, CHAIN)
    best, scored = brute_force(observations, along, CHAIN)
    assert_decodes(decoding, best)
    assert decoding.path == max(scored)[1]


class DenseChain(BaseHMM):
    """hmmlearn's chain with log-likelihoods as samples."""

    def _compute_log_likelihood(self, X: np.ndarray) -> np.ndarray:
        return X


@pytest.mark.parametrize("seed", range(8))
def test_viterbi_agrees_with_hmmlearn(seed: int) -> None:
    """While the robot keeps its pace the chain is homogeneous; hmmlearn starts after its first transition."""
    rng, K, T = np.random.default_rng(seed), 7, 9
    along, distance = np.cumsum(rng.uniform(0.3, 1.5, K)), 0.9
    observations = [Observation(distance, rng.normal(scale=2, size=K), float(rng.normal())) for _ in range(T)]
    A = dense_transitions(along, distance, MOTION, CHAIN)
    oracle = DenseChain(n_components=2 * K, algorithm="viterbi")
    oracle.startprob_, oracle.transmat_ = A[K], A
    _, states = oracle.decode(np.array([log_emissions(o, K) for o in observations]))
    assert viterbi(observations, along, MOTION, CHAIN).path == tuple(states)


@pytest.mark.parametrize("K", [1, 2, 7])
def test_emissions_sum_to_one_over_the_symbols(K: int) -> None:
    rng = np.random.default_rng(K)
    similarity = rng.random((K, K))
    emissions = Emissions(similarity / similarity.sum(axis=1, keepdims=True), CHAIN)
    seen = [emissions.log_likelihood(row) for row in np.eye(K)]
    places = np.sum([np.exp(place) for place, _ in seen], axis=0)
    lost = sum(math.exp(value) for _, value in seen)
    np.testing.assert_allclose(places + CHAIN.lost_view_at_place, 1.0)
    assert lost + CHAIN.lost_view_at_lost == pytest.approx(1.0)


def test_the_lost_view_is_a_symbol_of_its_own() -> None:
    emissions = Emissions(np.eye(8), CHAIN)
    uniform = np.full(8, 1 / 8)
    assert is_lost_view(uniform, CHAIN)
    assert not is_lost_view(np.eye(8)[2], CHAIN)
    places, lost = emissions.log_likelihood(uniform)
    np.testing.assert_allclose(np.exp(places), CHAIN.lost_view_at_place)
    assert math.exp(lost) == pytest.approx(CHAIN.lost_view_at_lost)


def test_places_stay_possible_where_nothing_is_alike() -> None:
    places, _ = Emissions(np.eye(5), CHAIN).log_likelihood(np.eye(5)[0])
    assert np.exp(places[1:]) == pytest.approx((1 - CHAIN.lost_view_at_place) * CHAIN.noise / 5)


def test_lost_views_lead_to_a_lost_place_and_back() -> None:
    """Three views of places 2, 3, 4, three that say nothing, then place 8: the robot was lost in between."""
    K = 10
    emissions = Emissions(np.eye(K), CHAIN)
    posteriors = [np.eye(K)[k] for k in (2, 3, 4)] + [np.full(K, 1 / K)] * 3 + [np.eye(K)[8]]
    observations = [Observation(1.0, *emissions.log_likelihood(p)) for p in posteriors]
    along = np.arange(float(K))
    path = viterbi(observations, along, MOTION, CHAIN).path
    assert path[:3] == (2, 3, 4)
    assert path[3:6] == (K + 5,) * 3
    assert path[6] == 8
    lost = [viterbi(observations[: t + 1], along, MOTION, CHAIN).lost.sum() for t in range(7)]
    assert max(lost[:3]) < 0.5 < min(lost[3:6])
    assert lost[6] < 0.5


def test_entropy_by_hand() -> None:
    assert entropy(np.array([0.5, 0.5, 0.0])) == pytest.approx(math.log(2))
    assert normalised_entropy(np.full(9, 1 / 9)) == pytest.approx(1.0)
    assert normalised_entropy(np.array([1.0])) == 0.0
    assert entropy(np.array([0.0, 1.0])) == 0.0
