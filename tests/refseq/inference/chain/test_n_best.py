from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.n_best import log_evidence, n_best_paths
from refseq.inference.chain.viterbi import viterbi
from tests.refseq.chains import MOTION, all_paths, chain_settings, drives, paths


@settings(derandomize=True)
@given(paths(4), chain_settings, st.integers(1, 400), st.data())
def test_they_are_the_best_of_all_paths(along: np.ndarray, s: ChainSettings, most: int, data: st.DataObject) -> None:
    """Every path of the tiny chain is scored; those that are asked for come in order, each once, with its own score."""
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=4, likelihood=6.0))
    scores, found = all_paths(observations, chain), n_best_paths(observations, chain, most)
    possible = np.sort(scores[scores > -np.inf])[::-1]
    assert [one.log_score for one in found] == pytest.approx(possible[:most], abs=1e-9)
    assert [scores[one.states] for one in found] == pytest.approx(possible[:most], abs=1e-9)
    assert len({one.states for one in found}) == len(found) == min(most, len(possible))
    assert log_evidence(observations, chain) == pytest.approx(logsumexp(scores), abs=1e-8)


def test_a_long_drive_s_first_is_viterbi_s_and_all_are_less_than_the_evidence() -> None:
    rng, K = np.random.default_rng(3), 40
    chain = Chain(np.cumsum(rng.uniform(0.3, 1.5, K)), MOTION, ChainSettings(kidnap_probability=0.1))
    observations = [Observation(0.9, rng.normal(scale=3, size=K), float(rng.normal())) for _ in range(30)]
    found = n_best_paths(observations, chain, 30)
    assert found[0].states == viterbi(observations, chain).path
    assert (np.diff([one.log_score for one in found]) <= 1e-9).all()
    assert logsumexp([one.log_score for one in found]) < log_evidence(observations, chain)


def test_shares_are_those_of_a_robot_that_nobody_carries_though_views_say_it_was() -> None:
    rng, K = np.random.default_rng(4), 4
    chain = Chain(np.arange(float(K)), MOTION, ChainSettings())
    came = [Observation(0.9, rng.normal(size=K), 0.0) for _ in range(4)]
    carried = [replace(one, carried=0.8) for one in came]
    assert log_evidence(carried, chain) == log_evidence(came, chain)
    shares = [one.log_score - log_evidence(carried, chain) for one in n_best_paths(carried, chain, 5000)]
    assert logsumexp(shares) == pytest.approx(0.0, abs=1e-9)
