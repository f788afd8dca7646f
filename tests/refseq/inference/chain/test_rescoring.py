"""Post-processing against all paths of tiny chains, scored by the words of the docstrings."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from refseq.inference.chain.chain import Chain, Observation
from refseq.inference.chain.n_best import RankedPath, n_best_paths
from refseq.inference.chain.rescoring import DurationModel, rescored, second_order_term
from tests.refseq.chains import MOTION, THESIS, all_paths, chain_settings, dense_window, drives, paths


def second_order(scores: np.ndarray, chain: Chain, observations: list[Observation], weight: float) -> np.ndarray:
    """All paths' scores, with the moves of a second-order chain."""
    whole, K = scores.copy(), chain.K
    for path in product(range(2 * K), repeat=len(observations)):
        for t in range(2, len(path)):
            i, j, k = path[t - 2 : t + 1]
            if max(i, j, k) >= K:
                continue
            d, before = observations[t].distance, observations[t - 1].distance
            joint = dense_window(chain.along, d, MOTION)[j] * dense_window(chain.along, d + before, MOTION)[i] ** weight
            once = dense_window(chain.along, d, MOTION)[j, k]
            with np.errstate(divide="ignore", invalid="ignore"):
                whole[path] += np.nan_to_num(np.log(joint[k] / joint.sum() / once), nan=-np.inf, neginf=-np.inf)
    return whole


@settings(deadline=None, max_examples=12, derandomize=True)
@given(paths(3), chain_settings, st.sampled_from([0.5, 1.0]), st.data())
def test_second_order_moves_are_those_of_all_paths(along: np.ndarray, s: object, w: float, data: st.DataObject) -> None:
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=4, likelihood=3.0))
    expected = second_order(all_paths(observations, chain), chain, observations, w)
    found = rescored(n_best_paths(observations, chain, 10**4), second_order_term(observations, chain, w))
    assert found[0].log_score == pytest.approx(expected.max(), abs=1e-9)
    for one in found[:: max(1, len(found) // 20)]:
        assert one.log_score == pytest.approx(expected[one.states], abs=1e-9)


def test_an_error_that_adds_up_costs_more_than_one_that_cancels_out() -> None:
    """Places every half metre, steps of a metre: half a metre too far twice, or once too far and once too short."""
    chain = Chain(np.arange(12) / 2, MOTION, THESIS)
    term = second_order_term([Observation(1.0, np.zeros(12), 0.0)] * 3, chain)
    even, cancels, adds_up = (term(RankedPath(states, 0.0)) for states in ((2, 4, 6), (2, 5, 6), (2, 5, 8)))
    assert even == pytest.approx(cancels, abs=0.5)
    assert cancels > adds_up + 0.5
    assert second_order_term([Observation(math.nan, np.zeros(12), 0.0)] * 3, chain)(RankedPath((2, 5, 8), 0.0)) == 0.0


@pytest.fixture
def uneven() -> tuple[Chain, list[Observation]]:
    """Places 1, 1 and 3 m apart; a drive in steps of half a metre that sees nothing."""
    chain = Chain(np.array([0.0, 1.0, 2.0, 5.0, 6.0]), MOTION, THESIS)
    return chain, [Observation(0.5, np.zeros(5), 0.0)] * 9


def test_durations_by_hand(uneven: tuple[Chain, list[Observation]]) -> None:
    chain, observations = uneven
    model = DurationModel.of(chain, spread=0.5)
    assert model.usual == pytest.approx([0.5, 1.0, 2.0, 2.0, 0.5])
    path = RankedPath((0, 1, 1, 2, 2, 2, 2, 7, 3), -1.0)  # the stay at a Lost_Place has no usual length
    assert model.ratios(path, observations) == pytest.approx([1.0, 1.0])
    shape = 4.0
    (found,) = rescored([path], model.term(observations, 0.5))
    assert found.log_score == pytest.approx(-1.0 + 0.5 * 2 * stats.gamma.logpdf(1.0, shape, scale=0.25))


def test_of_two_paths_the_one_whose_stays_are_usual_comes_first(uneven: tuple[Chain, list[Observation]]) -> None:
    chain, observations = uneven
    hurried = RankedPath((0, 1, 1, 1, 1, 2, 2, 3, 3), -1.0)
    usual = RankedPath((0, 1, 1, 2, 2, 2, 2, 3, 3), -1.2)
    model = DurationModel.of(chain)
    assert rescored([hurried, usual]) == [hurried, usual]
    assert [one.states for one in rescored([hurried, usual], model.term(observations))] == [
        usual.states,
        hurried.states,
    ]
    learnt = model.learnt(RankedPath((0, 1, 1, 1, 2, 2, 2, 3, 4), 0.0), observations)
    assert learnt.spread == pytest.approx(np.std([1.5, 0.75, 0.25]))
    assert model.learnt(RankedPath((0,) * 9, 0.0), observations) is model


def test_a_place_alone_and_paths_far_behind_each_other_have_usual_stays() -> None:
    assert DurationModel.of(Chain(np.zeros(1), MOTION, THESIS)).usual.tolist() == [1.0]
    two = Chain(np.array([0.0, 2.0, 10_000.0, 10_001.0]), MOTION, THESIS, (1, 3))
    assert DurationModel.of(two).usual.tolist() == [1.0, 1.0, 0.5, 0.5]
