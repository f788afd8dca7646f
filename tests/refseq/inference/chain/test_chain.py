from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.inference.chain.chain import Chain, ChainSettings
from refseq.inference.chain.forward import ForwardFilter
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.network import APART
from tests.refseq.chains import (
    MOTION,
    SPREAD,
    THESIS,
    all_paths,
    chain_settings,
    dense_transitions,
    distances,
    drives,
    log,
    paths,
)

quick = settings(derandomize=True)


@st.composite
def chains(draw: st.DrawFn, most: int = 6) -> Chain:
    motion = draw(st.sampled_from([MOTION, MotionSettings(slack=0.25, drift=0.0, tail=0.5), SPREAD]))
    along = draw(paths(most))
    cuts = sorted(draw(st.sets(st.integers(0, len(along) - 1), max_size=2)) - {len(along) - 1})
    for cut in cuts:
        along[cut + 1 :] += APART
    return Chain(along, motion, draw(chain_settings), (*cuts, len(along) - 1))


def close(chain: Chain) -> dict[str, float]:
    """How near is near enough: windows that are shared out cut gaps at 10 km and more, where a metre has 12 digits."""
    return {"rtol": 1e-10, "atol": 1e-12} if chain.motion.interpolated else {"rtol": 1e-12, "atol": 1e-15}


def numbers(K: int) -> st.SearchStrategy[np.ndarray]:
    """Non-negative numbers of all states."""
    value = st.one_of(st.floats(1e-9, 1), st.just(0.0))
    return st.lists(value, min_size=2 * K, max_size=2 * K).map(lambda drawn: np.array(drawn).reshape(2, K))


@quick
@given(chains(), distances, st.data())
def test_forward_and_backward_are_the_dense_products(chain: Chain, distance: float, data: st.DataObject) -> None:
    A, transitions = dense_transitions(chain, distance), chain.transitions(distance)
    states = data.draw(numbers(chain.K))
    before = states.copy()
    moved = transitions.predict(states)
    np.testing.assert_allclose(moved.ravel(), states.ravel() @ A, **close(chain))
    assert moved.sum() == pytest.approx(states.sum(), rel=1e-13)
    np.testing.assert_allclose(transitions.backward(states).ravel(), A @ states.ravel(), **close(chain))
    surprise = states.ravel() @ -(A * log(np.where(A > 0, A, 1)))
    np.testing.assert_allclose(transitions.surprise(states).ravel(), surprise, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(states, before)


@quick
@given(chains(), distances)
def test_rows_sum_to_one(chain: Chain, distance: float) -> None:
    np.testing.assert_allclose(dense_transitions(chain, distance).sum(axis=1), 1.0)
    np.testing.assert_allclose(chain.transitions(distance).backward(np.ones((2, chain.K))), 1.0, rtol=1e-13)


@quick
@given(chains(), distances, st.data())
def test_best_is_the_dense_maximum(chain: Chain, distance: float, data: st.DataObject) -> None:
    K, A, transitions = chain.K, log(dense_transitions(chain, distance)), chain.transitions(distance)
    scores = log(data.draw(numbers(K)))
    best = transitions.best(scores).ravel()
    # From path to path nothing leads, or e^-1000 of it, which no float holds.
    np.testing.assert_allclose(
        np.maximum(best, -600), (scores.reshape(2 * K, 1) + A).max(axis=0).clip(-600), atol=1e-10
    )
    for state in range(2 * K):
        into = transitions.predecessors(state).ravel()
        np.testing.assert_allclose(np.maximum(into, -600), A[:, state].clip(-600), atol=1e-10)


@pytest.mark.parametrize("distance", [3.0, 0.2, 0.0, -1.0])
@pytest.mark.parametrize("spacing", [lambda rng: np.full(3000, 0.2), lambda rng: rng.exponential(2.0, 3000)])
def test_long_paths_keep_the_mass(spacing: Callable[[np.random.Generator], np.ndarray], distance: float) -> None:
    """Kilometres of path are beyond the range of exp(distance / near)."""
    rng = np.random.default_rng(1)
    along = np.cumsum(spacing(rng))
    states = 10 ** rng.uniform(-200, 0, (2, 3000))
    states /= states.sum()
    transitions = Chain(along, MOTION, ChainSettings(relocalisation_range=2.0, kidnap_probability=0.1)).transitions(
        distance
    )
    assert transitions.predict(states).sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(transitions.backward(np.ones((2, 3000))), 1.0, rtol=1e-11)


def found_again(chain: Chain, distance: float, lost: int) -> np.ndarray:
    """Where the robot turns up after a step from one Lost_Place."""
    states = np.zeros((2, chain.K))
    states[1, lost] = 1.0
    return chain.transitions(distance).predict(states)


def test_a_lost_robot_turns_up_ahead_and_when_it_reverses_behind_as_well() -> None:
    chain = Chain(np.arange(9.0), MOTION, THESIS)
    ahead, around = found_again(chain, 1.0, 4)[0], found_again(chain, -1.0, 4)[0]
    assert not ahead[:4].any()
    assert (np.diff(ahead[4:]) < 0).all()
    np.testing.assert_allclose(around[:4], around[:4:-1])
    assert around.argmax() == 4


@pytest.mark.parametrize(
    ("along", "ends"),
    [
        (np.array([0.0, APART, 2 * APART]), (0, 1, 2)),  # paths of one place each
        (np.array([0.0, APART, APART + 0.5, 2 * APART]), (0, 2, 3)),
    ],
)
def test_a_motion_that_nobody_measured_leads_to_no_other_path(along: np.ndarray, ends: tuple[int, ...]) -> None:
    """Paths lie far behind each other: the usual way from place to place is not across that."""
    moves = Chain(along, MOTION, THESIS, ends).transitions(float("nan"))
    for place in range(len(along)):
        states = np.zeros((2, len(along)))
        states[0, place] = 1.0
        reached = np.flatnonzero(moves.predict(states)[0])
        assert (np.abs(along[reached] - along[place]) < 2).all()


def test_restarting_leads_anywhere_by_way_of_lost_0() -> None:
    chain = Chain(np.arange(9.0), MOTION, ChainSettings(stay_lost=0.6, kidnap_probability=0.25))
    moved = found_again(chain, 1.0, 4)
    assert moved[1, 0] == pytest.approx(0.4 * 0.25)
    assert moved[1, 4] == pytest.approx(0.6)
    np.testing.assert_allclose(found_again(chain, 1.0, 0)[0], 0.4 / 9)


def test_getting_lost_by_the_metre_does_not_depend_on_the_steps() -> None:
    settings = ChainSettings(lost_per_metre=0.2)
    on_path = 1 - settings.getting_lost(3.0)
    assert (1 - settings.getting_lost(0.25)) ** 12 == pytest.approx(on_path)
    assert (1 - settings.getting_lost(-3.0)) == pytest.approx(on_path)
    assert settings.getting_lost(0.0) == 0.0
    assert ChainSettings(lost=0.3).getting_lost(7.0) == 0.3


@settings(derandomize=True)
@given(chains(4), st.data())
def test_the_lost_places_tell_which_place_a_path_was_at_last(chain: Chain, data: st.DataObject) -> None:
    """Of all paths that are lost now, and not by way of forgetting: the last place on each."""
    K, observations = chain.K, data.draw(drives(chain.K, most=4, likelihood=3.0))
    shares = all_paths(observations, chain)
    shares = np.exp(shares - shares.max())
    shares /= shares.sum()
    expected = np.zeros(K)
    for path in zip(*np.nonzero(shares), strict=True):
        on_path = [state for state in path if state < K]
        if path[-1] > K and on_path:
            expected[on_path[-1]] += shares[path]
    tracker = ForwardFilter(chain)
    for observation in observations:
        posterior = tracker.update(observation)
    # A path's last Lost_Place lies behind its last two places and cannot tell them apart.
    after = chain.lost_after(posterior.lost)
    np.testing.assert_allclose(np.bincount(chain.behind, after, K), np.bincount(chain.behind, expected, K), atol=1e-12)
    assert after.sum() == pytest.approx(posterior.lost[1:].sum(), abs=1e-12)
