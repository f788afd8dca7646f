from dataclasses import replace

import numpy as np
import pytest

from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.forward import ForwardFilter, StatePosterior
from refseq.inference.chain.network import Network
from refseq.inference.chain.path_filter import one_path, path_filter
from refseq.inference.chain.run_out import MOST, LongerNetwork, RunOutFilter, run_out
from refseq.map.profile import BEST
from tests.refseq.chains import SPREAD, dense_start, dense_transitions

SETTINGS = replace(BEST.chain, run_out=3.0, vague=0.0)


def by_matrices(chain: Chain, longer: Chain, views: list[Observation]) -> np.ndarray:
    """The folded posterior of the last view, (2, K), by dense matrices over the path with three positions more."""
    K, N = chain.K, longer.K
    end = K - 1
    states = np.zeros(2 * N)
    states[:K], states[N : N + K] = np.split(dense_start(chain), 2)
    for number, view in enumerate(views):
        if number:
            states = states @ dense_transitions(longer, view.distance)
        likelihood = np.exp([*view.places, *[view.places[end]] * (N - K), *[view.lost] * N])
        states = states * likelihood / (states * likelihood).sum()
    places, lost = states.reshape(2, N)
    folded = np.stack([places[:K], lost[:K]])
    folded[0, end] += places[K]  # one step behind the end still counts as the end
    folded[1, end] += places[K + 1 :].sum() + lost[K:].sum()
    return folded


@pytest.mark.parametrize("seed", range(6))
def test_it_is_the_filter_of_a_longer_path(seed: int) -> None:
    rng = np.random.default_rng(seed)
    along = np.array([0.0, 1.0, 2.0, 3.5, 4.5])
    chain = Chain(along, SPREAD, SETTINGS)
    longer = Chain(np.array([*along, 5.5, 6.5, 7.5]), SPREAD, SETTINGS)
    views = [Observation(rng.choice([1.0, 0.5, 2.0, -1.0]), rng.normal(0, 2, 5), 0.0) for _ in range(7)]
    filtered = path_filter(chain)
    for view in views:
        posterior = filtered.update(view)
    np.testing.assert_allclose([posterior.places, posterior.lost], by_matrices(chain, longer, views), atol=1e-12)


def last_belief(settings: ChainSettings, steps: int, log_ratio: float) -> StatePosterior:
    """After a drive along ten places and ``steps`` [m] on, the last place in sight to the end."""
    filtered = path_filter(Chain(np.arange(10.0), SPREAD, settings))
    for place in range(10 + steps):
        view = np.full(10, -1.5)
        view[min(place, 9)] = log_ratio
        posterior = filtered.update(Observation(1.0, view, 0.0))
    return posterior


def test_a_robot_that_drives_on_is_lost_though_the_last_place_stays_in_sight() -> None:
    assert last_belief(SETTINGS, 0, 3.0).places[9] > 0.9
    assert last_belief(SETTINGS, 1, 3.0).places[9] > 0.9  # no farther than places lie apart
    gone = last_belief(SETTINGS, 3, 3.0)
    assert gone.lost[9] > 0.9, "lost behind the last place"
    assert last_belief(replace(SETTINGS, run_out=0.0), 3, 3.0).places[9] > 0.9, "what it is for"


def test_without_a_run_out_it_is_the_plain_filter() -> None:
    assert isinstance(path_filter(Chain(np.arange(4.0), SPREAD, ChainSettings())), ForwardFilter)


def test_several_paths_each_have_their_own() -> None:
    """Two paths that share nothing and see nothing: what leaves one is lost behind its own end."""
    network = Network((np.arange(3.0), np.arange(4.0)), np.arange(7), SPREAD, SETTINGS)
    filtered = RunOutFilter(LongerNetwork.of(network, 3.0))
    sight = np.where(np.arange(7) == 2, 20.0, 0.0)  # it starts at the first one's end
    for view in [sight, *[np.zeros(7)] * 3]:
        posterior = filtered.update(Observation(1.0, view, 0.0))
    assert posterior.places.shape == posterior.lost.shape == (7,)
    assert posterior.places.sum() + posterior.lost.sum() == pytest.approx(1.0)
    assert posterior.lost[2] > 0.8
    assert posterior.lost[6] < 1e-3


def test_a_run_out_goes_on_by_the_usual_step_and_is_bounded() -> None:
    np.testing.assert_allclose(run_out(np.array([0.0, 1.0, 2.0, 9.0]), 3.0), [10.0, 11.0, 12.0])
    assert len(run_out(np.arange(9.0), 0.2)) == 1
    for dense in (np.zeros(5), np.zeros(1), np.linspace(0, 1e-6, 50)):
        assert len(run_out(dense, 10.0)) == MOST


def test_one_path_is_a_network() -> None:
    chain = Chain(np.arange(5.0), SPREAD, ChainSettings())
    np.testing.assert_array_equal(one_path(chain).start(), chain.start())
