import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.emissions import Emissions, Seen
from refseq.inference.chain.viterbi import Decoding, SlidingViterbi, viterbi
from tests.refseq.chains import (
    MOTION,
    THESIS,
    all_paths,
    chain_settings,
    dense_oracle,
    drives,
    log_likelihoods,
    paths,
)


def assert_decodes(decoding: Decoding, scores: np.ndarray) -> None:
    """``scores`` are those of all paths: the best to each last state, and the best of all."""
    best = scores.max(axis=tuple(range(scores.ndim - 1)))
    weights = np.exp(best - best.max())
    np.testing.assert_allclose(np.concatenate([decoding.places, decoding.lost]), weights / weights.sum(), atol=1e-9)
    # Rounding may choose among equals, so the path's own score is compared.
    assert scores[decoding.path] == pytest.approx(scores.max(), abs=1e-9)


@settings(derandomize=True)
@given(paths(5), chain_settings, st.data())
def test_it_is_the_best_of_all_paths(along: np.ndarray, s: ChainSettings, data: st.DataObject) -> None:
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=6, likelihood=6.0))
    assert_decodes(viterbi(observations, chain), all_paths(observations, chain))


def test_five_places_and_six_views() -> None:
    rng = np.random.default_rng(2)
    chain = Chain(np.array([0.0, 0.8, 2.0, 2.9, 4.0]), MOTION, ChainSettings(kidnap_probability=0.1))
    observations = [Observation(d, rng.normal(size=5), float(rng.normal())) for d in (0, 0.9, 0.7, -1.1, 0, 2.3)]
    scores = all_paths(observations, chain)
    assert scores.size == 10**6
    assert_decodes(viterbi(observations, chain), scores)
    assert viterbi(observations, chain).path == np.unravel_index(scores.argmax(), scores.shape)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("distance", [0.9, 0.0, -0.9])
def test_it_agrees_with_hmmlearn(seed: int, distance: float) -> None:
    """While the robot keeps its pace the chain is homogeneous; hmmlearn starts after its first transition."""
    rng, K, T = np.random.default_rng(seed), 30, 25
    chain = Chain(np.cumsum(rng.uniform(0.3, 1.5, K)), MOTION, ChainSettings(lost=0.3, kidnap_probability=0.1))
    observations = [Observation(distance, rng.normal(scale=2, size=K), float(rng.normal())) for _ in range(T)]
    oracle = dense_oracle(chain, distance)
    _, states = oracle.decode(np.array([log_likelihoods(o, K) for o in observations]))
    assert viterbi(observations, chain).path == tuple(states)


@pytest.mark.parametrize("T", [1, 2, 5])
def test_the_window_slides(T: int) -> None:
    """Each answer is that of the last T views alone; after a reset, of the views since."""
    rng, K = np.random.default_rng(T), 12
    chain = Chain(np.cumsum(rng.uniform(0.3, 1.5, K)), MOTION, ChainSettings(window=T))
    views = [Observation(float(rng.uniform(-1, 2)), rng.normal(size=K), 0.0) for _ in range(9)]
    decoder = SlidingViterbi(chain)
    for start in (0, 4):
        decoder.reset()
        for t in range(start, len(views)):
            found, expected = decoder.update(views[t]), viterbi(views[max(start, t + 1 - T) : t + 1], chain)
            np.testing.assert_array_equal(found.places, expected.places)
            np.testing.assert_array_equal(found.lost, expected.lost)
            assert found.path == expected.path
            assert len(found.path) == min(T, t + 1 - start)


def test_a_window_of_one_view_takes_its_likeliest_place() -> None:
    """From Lost_0 all places are alike, so that a single view decides by itself."""
    places = np.log([0.1, 0.6, 0.3])
    decoding = SlidingViterbi(Chain(np.arange(3.0), MOTION, ChainSettings(window=1))).update(
        Observation(0.0, places, float(np.log(0.1)))
    )
    assert decoding.path == (1,)
    weights = np.array([0.1, 0.6, 0.3, 0.1 * 3, 0, 0])  # 0.5 / K to each place, 0.5 to Lost_0
    np.testing.assert_allclose(np.concatenate([decoding.places, decoding.lost]), weights / weights.sum(), atol=1e-12)


def test_lost_views_lead_to_a_lost_place_and_back() -> None:
    """Three views of places 2, 3, 4, three that say nothing, then place 8: the robot was lost in between."""
    K = 10
    emissions = Emissions.from_posteriors(np.eye(K), THESIS)
    posteriors = [np.eye(K)[k] for k in (2, 3, 4)] + [np.full(K, 1 / K)] * 3 + [np.eye(K)[8]]
    observations = [Observation(1.0, *emissions.log_likelihood(Seen(p, p))) for p in posteriors]
    chain = Chain(np.arange(float(K)), MOTION, THESIS)
    assert viterbi(observations, chain).path == (2, 3, 4, K + 5, K + 5, K + 5, 8)
    lost = [viterbi(observations[: t + 1], chain).lost.sum() for t in range(7)]
    assert max(lost[:3]) < 0.5 < min(lost[3:6])
    assert lost[6] < 0.5
    # Behind place 4 it got lost: a window knows that as long as it holds a view from there.
    for T, behind in ((5, 4), (2, None)):
        decoder = SlidingViterbi(Chain(np.arange(float(K)), MOTION, ChainSettings(window=T)))
        found = [decoder.update(o).lost for o in observations[:6]][-1]
        assert (int(found.argmax()) - 1 if found.argmax() else None) == behind


def test_the_chain_finds_the_place_on_a_grid_finer_than_the_views() -> None:
    """Views every metre, states every 0.2 m: the path follows the robot to the state."""
    along = np.arange(0, 30, 0.2)
    chain = Chain(along, MOTION, ChainSettings(lost_per_metre=0.05))
    truth = [5.0, 6.2, 7.2, 8.6, 9.8]
    observations = [
        Observation(float(distance), -(((along - at) / 0.3) ** 2) / 2, -8.0)
        for distance, at in zip(np.diff(truth, prepend=4.0), truth, strict=True)
    ]
    np.testing.assert_allclose(along[list(viterbi(observations, chain).path)], truth, atol=1e-9)
