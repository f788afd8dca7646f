"""Vague views: two suppositions, weighed by what each expected; held against sums over all paths."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.forward import ForwardFilter, StatePosterior
from refseq.inference.chain.path_filter import path_filter, path_smoothed
from refseq.inference.chain.vague import NOTHING, VagueFilter, vaguely
from refseq.map.profile import BEST
from tests.refseq.chains import MOTION, SPREAD, all_paths, chain_settings, drives, marginal, paths

PATH = np.arange(20.0)
UNSURE = replace(BEST.chain, vague=0.0)


def states(posterior: StatePosterior) -> np.ndarray:
    return np.concatenate([posterior.places, posterior.lost])


@settings(derandomize=True)
@given(paths(4), chain_settings, st.floats(0.01, 0.99), st.data())
def test_it_is_the_sum_over_both_suppositions_and_all_paths(
    along: np.ndarray, s: ChainSettings, chance: float, data: st.DataObject
) -> None:
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=4, likelihood=3.0))
    both, evidence = VagueFilter(ForwardFilter(chain), ForwardFilter(chain), chance), 0.0
    for t, observation in enumerate(observations):
        seen = observations[: t + 1]
        scores = [all_paths(seen, chain), all_paths([vaguely(one) for one in seen], chain)]
        weights = np.log([1 - chance, chance]) + [logsumexp(one) for one in scores]
        shares = np.exp(weights - logsumexp(weights))
        posterior = both.update(observation)
        expected = sum(share * marginal(one, t) for share, one in zip(shares, scores, strict=True))
        np.testing.assert_allclose(states(posterior), expected, atol=1e-9)
        evidence += posterior.log_evidence
        assert evidence == pytest.approx(logsumexp(weights), abs=1e-8)


@given(st.floats(-700, 700), st.floats(-700, 700))
def test_a_vague_view_is_as_likely_anywhere_with_a_chance(place: float, lost: float) -> None:
    told = vaguely(Observation(1.0, np.array([place]), lost))
    assert told.lost == lost
    expected = logsumexp([0.0, place - lost], b=[NOTHING, 1 - NOTHING])
    assert told.places[0] - lost == pytest.approx(expected, abs=1e-9)


@settings(derandomize=True)
@given(paths(4), chain_settings, st.floats(0.01, 0.99), st.data())
def test_in_hindsight_it_is_the_sum_over_both_as_well(
    along: np.ndarray, s: ChainSettings, chance: float, data: st.DataObject
) -> None:
    chain = Chain(along, MOTION, replace(s, vague=chance))
    observations = data.draw(drives(chain.K, most=4, likelihood=3.0))
    scores = [all_paths(observations, chain), all_paths([vaguely(one) for one in observations], chain)]
    weights = np.log([1 - chance, chance]) + [logsumexp(one) for one in scores]
    shares = np.exp(weights - logsumexp(weights))
    smoothed = path_smoothed(observations, chain)
    for t, posterior in enumerate(smoothed):
        expected = sum(share * marginal(one, t) for share, one in zip(shares, scores, strict=True))
        np.testing.assert_allclose(states(posterior), expected, atol=1e-9)
    assert sum(posterior.log_evidence for posterior in smoothed) == pytest.approx(logsumexp(weights), abs=1e-8)


def drive(log_ratios: list[tuple[float, float]]) -> list[Observation]:
    """Along ``PATH`` from its first place: the log ratio of the robot's own place at each view, and of all others."""
    views = []
    for number, (here, elsewhere) in enumerate(log_ratios):
        told = np.full(len(PATH), elsewhere)
        told[min(number, len(PATH) - 1)] = here
        views.append(Observation(1.0, told, 0.0))
    return views


def lost(chance: float, views: list[Observation]) -> np.ndarray:
    filtered = path_filter(Chain(PATH, SPREAD, replace(UNSURE, vague=chance)))
    return np.array([filtered.update(view).lost.sum() for view in views])


def test_views_that_tell_nothing_at_all_are_less_of_a_reason_to_be_lost() -> None:
    """Two that knew the place, and twelve that speak against all places a little, the robot's own among them."""
    views = drive([(4.0, -1.0)] * 2 + [(-0.6, -0.9)] * 12)
    without, asking = lost(0.0, views), lost(0.2, views)
    assert (asking < without)[4:].all()
    assert asking[-1] < without[-1] - 0.1


def test_who_leaves_the_path_of_a_clear_drive_is_as_lost_as_before() -> None:
    views = drive([(4.0, -1.0)] * 8 + [(-0.9, -0.9)] * 10)
    without, asking = lost(0.0, views), lost(0.2, views)
    np.testing.assert_allclose(asking, without, atol=0.01)
    assert asking[-1] > 0.9


def test_a_drive_that_has_settled_asks_one_filter_alone() -> None:
    """To the last bit, whatever comes later, until it begins anew."""
    views = drive([(6.0, -1.5)] * 30)
    clear, both = (
        ForwardFilter(Chain(PATH, SPREAD, UNSURE)),
        path_filter(Chain(PATH, SPREAD, replace(UNSURE, run_out=0.0, vague=0.2))),
    )
    answers = [(states(clear.update(view)), states(both.update(view))) for view in views]
    assert not np.array_equal(*answers[3])
    np.testing.assert_array_equal(*answers[-1])
    both.reset()
    np.testing.assert_array_equal(states(both.update(views[0])), answers[0][1])


def test_views_of_a_stand_count_once() -> None:
    """However often the same is seen, the last view of a stand takes the place of those before."""
    chain = Chain(PATH, SPREAD, replace(UNSURE, vague=0.2))
    first, *others = drive([(1.0, -0.5), (0.3, -0.9), (2.0, -1.0)])
    once, often = path_filter(chain), path_filter(chain)
    for view in (first, *others):
        expected = once.update(view)
    for view in (first, others[0], *[replace(others[0], distance=0.0, again=True)] * 5, others[1]):
        found = often.update(view)
    np.testing.assert_allclose(states(found), states(expected), atol=1e-12)
