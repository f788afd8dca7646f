from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.emissions import Emissions, Seen
from refseq.inference.chain.forward import ForwardFilter, StatePosterior, log_moved, smooth
from tests.refseq.chains import MOTION, THESIS, all_paths, chain_settings, dense_transitions, drives, marginal, paths


def states(posterior: StatePosterior) -> np.ndarray:
    return np.concatenate([posterior.places, posterior.lost])


@settings(derandomize=True)
@given(paths(5), chain_settings, st.sampled_from([3.0, 500.0]), st.data())
def test_filter_and_smoother_are_the_sums_over_all_paths(
    along: np.ndarray, s: ChainSettings, likelihood: float, data: st.DataObject
) -> None:
    """Also where views tell places apart by e^1000, where evidence changes sides, and of a robot that is carried."""
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=5, likelihood=likelihood, carried=1.0))
    scores, tracker, evidence = all_paths(observations, chain), ForwardFilter(chain), 0.0
    for t, observation in enumerate(observations):
        now = all_paths(observations[: t + 1], chain)
        posterior = tracker.update(observation)
        np.testing.assert_allclose(states(posterior), marginal(now, t), atol=1e-9)
        evidence += posterior.log_evidence
        assert evidence == pytest.approx(logsumexp(now), abs=1e-8)
    for t, posterior in enumerate(smooth(observations, chain)):
        np.testing.assert_allclose(states(posterior), marginal(scores, t), atol=1e-9)


def test_five_places_and_six_views() -> None:
    rng = np.random.default_rng(2)
    chain = Chain(np.array([0.0, 0.8, 2.0, 2.9, 4.0]), MOTION, ChainSettings(kidnap_probability=0.1))
    observations = [Observation(d, rng.normal(size=5), float(rng.normal())) for d in (0, 0.9, 0.7, -1.1, 0, 2.3)]
    scores = all_paths(observations, chain)
    for t, posterior in enumerate(smooth(observations, chain)):
        np.testing.assert_allclose(states(posterior), marginal(scores, t), atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("distance", [0.9, 0.0, -0.9])
def test_they_agree_with_hmmlearn(seed: int, distance: float) -> None:
    """The thesis' hard symbols: the K views and the Lost View; a posterior that is sure, or knows nothing."""
    from hmmlearn.hmm import CategoricalHMM  # more than half a second, which not every process of a run needs to spend

    rng, K, T = np.random.default_rng(seed), 25, 40
    settings = ChainSettings(lost=0.2, kidnap_probability=0.05)
    chain = Chain(np.cumsum(rng.uniform(0.3, 1.5, K)), MOTION, settings)
    emissions = Emissions.from_posteriors(rng.dirichlet(np.full(K, 0.2), K), settings)
    symbols = rng.integers(0, K + 1, T)
    posteriors = np.vstack([np.eye(K), np.full(K, 1 / K)])
    observations = [
        Observation(distance, *emissions.log_likelihood(Seen(posteriors[symbol], posteriors[symbol])))
        for symbol in symbols
    ]

    A = dense_transitions(chain, distance)
    seen = (1 - settings.noise) * emissions.similarity + settings.noise / K
    oracle = CategoricalHMM(n_components=2 * K)
    oracle.n_features, oracle.startprob_, oracle.transmat_ = K + 1, A[K], A
    oracle.emissionprob_ = np.block(
        [
            [(1 - settings.lost_view_at_place) * seen, np.full((K, 1), settings.lost_view_at_place)],
            [np.full((K, K), (1 - settings.lost_view_at_lost) / K), np.full((K, 1), settings.lost_view_at_lost)],
        ]
    )
    log_probability, expected = oracle.score_samples(symbols[:, None])
    smoothed = smooth(observations, chain)
    np.testing.assert_allclose([states(posterior) for posterior in smoothed], expected, atol=1e-9)
    assert sum(posterior.log_evidence for posterior in smoothed) == pytest.approx(log_probability, rel=1e-12)


def test_the_last_view_is_smoothed_as_it_was_filtered() -> None:
    rng, K = np.random.default_rng(5), 40
    chain = Chain(np.cumsum(rng.uniform(0.3, 1.5, K)), MOTION, THESIS)
    observations = [Observation(0.9, rng.normal(scale=3, size=K), 0.0) for _ in range(12)]
    tracker = ForwardFilter(chain)
    filtered = [tracker.update(observation) for observation in observations]
    smoothed = smooth(observations, chain)
    np.testing.assert_allclose(states(smoothed[-1]), states(filtered[-1]), atol=1e-12)
    assert np.abs(states(smoothed[0]) - states(filtered[0])).max() > 0.01
    tracker.reset()
    np.testing.assert_array_equal(states(tracker.update(observations[0])), states(filtered[0]))


def clear_view(at: int, K: int) -> Observation:
    """A view after a metre that is of one place and of no other."""
    return Observation(1.0, 16.0 * np.eye(K)[at] - 6.0, 0.0)


def test_a_robot_carried_off_is_found_again() -> None:
    """It is sure of place 40, then set down at place 5 by hand: restarting finds it there at the third view."""
    K = 60
    chain = Chain(np.arange(float(K)), MOTION, ChainSettings(lost_per_metre=0.1, kidnap_probability=0.1))
    tracker = ForwardFilter(chain)
    for at in (37, 38, 39, 40):
        posterior = tracker.update(clear_view(at, K))
    assert posterior.places[40] > 0.95
    found = [tracker.update(clear_view(at, K)) for at in (5, 6, 7)]
    assert found[0].lost.sum() > 0.9
    assert found[-1].places[7] > 0.95


@pytest.mark.parametrize(("carried", "least", "most"), [(0, 0, 1e-4), (0.03, 0.8, 0.9), (0.5, 0.98, 1)])
def test_who_knows_that_it_was_carried_is_found_at_once(carried: float, least: float, most: float) -> None:
    """One view that is e^10 times likelier at place 5 than anywhere else, where place 41 was expected."""
    K = 60
    chain = Chain(np.arange(float(K)), MOTION, ChainSettings(lost_per_metre=0.01, stay_lost=0.9))
    tracker = ForwardFilter(chain)
    for at in (37, 38, 39, 40):
        tracker.update(clear_view(at, K))
    seen = replace(clear_view(5, K), places=10.0 * np.eye(K)[5] - 1.0, carried=carried)
    assert least <= tracker.update(seen).places[5] <= most


def test_who_is_carried_off_the_map_knows_where_it_was_last_sure() -> None:
    """Views of no place follow, so that it is lost; Lost_0 has what it might have forgotten on the way."""
    K = 60
    chain = Chain(np.arange(float(K)), MOTION, ChainSettings(lost_per_metre=0.01, stay_lost=0.9, lost_at_start=0.1))
    tracker = ForwardFilter(chain)
    for at in (37, 38, 39, 40):
        tracker.update(clear_view(at, K))
    nowhere = Observation(1.0, np.full(K, -3.0), 0.0)
    lost = [tracker.update(one) for one in (replace(nowhere, carried=0.9), nowhere, nowhere)]
    assert lost[-1].lost.sum() > 0.9
    assert chain.lost_after(lost[-1].lost)[40] > 0.8


def test_numbers_too_far_apart_for_one_exponent_move_as_logarithms() -> None:
    rng = np.random.default_rng(4)
    logs, A = rng.uniform(-3000, 100, (2, 6)), rng.dirichlet(np.ones(12), 12)
    moved = log_moved(lambda p: (p.ravel() @ A).reshape(2, 6), logs)
    np.testing.assert_allclose(moved.ravel(), logsumexp(logs.reshape(12, 1) + np.log(A), axis=0), rtol=1e-12)
    alone = log_moved(lambda p: p, logs)  # nothing mixes: each band must come through by itself
    np.testing.assert_allclose(alone, logs, rtol=1e-12)
    assert (log_moved(lambda p: p, np.full((2, 3), -np.inf)) == -np.inf).all()
