import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp, xlogy

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.trajectory_entropy import trajectory_entropy
from tests.refseq.chains import (
    MOTION,
    all_paths,
    chain_settings,
    dense_transitions,
    drives,
    log,
    log_likelihoods,
    paths,
)


@settings(derandomize=True)
@given(paths(5), chain_settings, st.sampled_from([3.0, 500.0]), st.data())
def test_it_is_the_entropy_over_all_paths(
    along: np.ndarray, s: ChainSettings, likelihood: float, data: st.DataObject
) -> None:
    chain = Chain(along, MOTION, s)
    observations = data.draw(drives(chain.K, most=5, likelihood=likelihood))
    scores = all_paths(observations, chain)
    p = np.exp(scores - logsumexp(scores))
    assert trajectory_entropy(observations, chain) == pytest.approx(-xlogy(p, p).sum(), abs=1e-9)


def test_five_places_and_six_views() -> None:
    rng = np.random.default_rng(2)
    chain = Chain(np.array([0.0, 0.8, 2.0, 2.9, 4.0]), MOTION, ChainSettings(kidnap_probability=0.1))
    observations = [Observation(d, rng.normal(size=5), float(rng.normal())) for d in (0, 0.9, 0.7, -1.1, 0, 2.3)]
    scores = all_paths(observations, chain)
    p = np.exp(scores - logsumexp(scores))
    assert trajectory_entropy(observations, chain) == pytest.approx(-xlogy(p, p).sum(), rel=1e-12)


def entropy_by_pairs(observations: list[Observation], chain: Chain) -> float:
    """H(path) = Σ H(s_t, s_t+1) − Σ H(s_t) over inner views, since the path given the views is a Markov chain too."""
    K = chain.K
    A = [log(dense_transitions(chain, o.distance)) for o in observations]
    b = [log_likelihoods(o, K) for o in observations]
    forward, backward = [A[0][K] + b[0]], [np.zeros(2 * K)]
    for t in range(1, len(observations)):
        forward.append(logsumexp(forward[-1][:, None] + A[t], axis=0) + b[t])
        backward.insert(0, logsumexp(A[-t] + b[-t] + backward[0], axis=1))
    evidence = logsumexp(forward[-1])
    total = 0.0
    for t in range(len(observations)):
        single = np.exp(forward[t] + backward[t] - evidence)
        total += xlogy(single, single).sum() if 0 < t < len(observations) - 1 else 0.0
        if t + 1 < len(observations):
            pair = np.exp(forward[t][:, None] + A[t + 1] + b[t + 1] + backward[t + 1] - evidence)
            total -= xlogy(pair, pair).sum()
    return float(total)


@pytest.mark.parametrize("seed", range(4))
def test_a_longer_drive_agrees_with_the_entropy_by_pairs(seed: int) -> None:
    rng, K = np.random.default_rng(seed), 40
    chain = Chain(np.cumsum(rng.uniform(0.1, 1.5, K)), MOTION, ChainSettings(lost=0.2, kidnap_probability=0.1))
    observations = [
        Observation(float(rng.uniform(-1, 2)), rng.normal(scale=2, size=K), float(rng.normal())) for _ in range(15)
    ]
    assert trajectory_entropy(observations, chain) == pytest.approx(entropy_by_pairs(observations, chain), rel=1e-10)


def test_one_view_by_hand() -> None:
    """From Lost_0 half goes to four places alike and half stays: H = ½ log 2 + ½ log 8."""
    chain = Chain(np.arange(4.0), MOTION, ChainSettings())
    assert trajectory_entropy([Observation(0.0, np.zeros(4), 0.0)], chain) == pytest.approx(2 * math.log(2))


def test_sure_views_leave_no_doubt() -> None:
    chain = Chain(np.arange(20.0), MOTION, ChainSettings())
    sure = [Observation(1.0, 600.0 * np.eye(20)[k], 0.0) for k in range(3, 12)]
    blank = [Observation(1.0, np.zeros(20), 0.0) for _ in range(9)]
    assert trajectory_entropy(sure, chain) == pytest.approx(0.0, abs=1e-9)
    assert trajectory_entropy(blank, chain) > 10
