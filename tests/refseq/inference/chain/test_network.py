"""Several paths as one chain: no way leads from one to another but by the links."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.network import Network

SETTINGS = ChainSettings(lost_per_metre=0.1, kidnap_probability=0.3, relocalisation_range=3.0)


@st.composite
def networks(draw: st.DrawFn) -> Network:
    """Up to three paths, some of whose positions are at the same place."""
    lengths = draw(st.lists(st.integers(1, 5), min_size=1, max_size=3))
    steps = [draw(st.lists(st.floats(0.1, 3), min_size=n, max_size=n)) for n in lengths]
    places = draw(st.lists(st.integers(0, sum(lengths)), min_size=sum(lengths), max_size=sum(lengths)))
    paths = tuple(np.cumsum(one) for one in steps)
    loops = draw(st.lists(st.tuples(*[st.integers(0, sum(lengths))] * 2), max_size=3))
    pairs = np.array(loops, np.intp).reshape(-1, 2)
    return Network(paths, np.array(places), MotionSettings(), SETTINGS, draw(st.floats(0, 1)), pairs)


def dense(network: Network, distance: float) -> np.ndarray:
    """The transition matrix, (2 K, 2 K): rows are where from."""
    moves, K = network.transitions(distance), network.K
    return np.array([moves.predict(state.reshape(2, K)).ravel() for state in np.eye(2 * K)])


@given(networks(), st.floats(-3, 3))
def test_moves_are_probabilities_and_backward_is_their_transpose(network: Network, distance: float) -> None:
    moves, K = network.transitions(distance), network.K
    matrix = dense(network, distance)
    assert (matrix >= 0).all()
    assert matrix.sum(axis=1) == pytest.approx(np.ones(2 * K))
    back = np.array([moves.backward(state.reshape(2, K)).ravel() for state in np.eye(2 * K)])
    np.testing.assert_allclose(back.T, matrix, atol=1e-12)


@given(networks())
def test_a_drive_begins_somewhere_and_a_shared_spot_counts_once(network: Network) -> None:
    start = np.exp(network.start())
    assert start.sum() == pytest.approx(1.0)
    by_spot = np.bincount(spots_of(network), start[0])
    assert by_spot[by_spot > 0] == pytest.approx(by_spot.max())


def spots_of(network: Network) -> np.ndarray:
    """Number of the least place that can be reached from each position's, by trying all loops again and again."""
    least = np.arange(100)
    for _ in range(100):
        for pair in network.loops.tolist():
            least[pair] = least[pair].min()
    return least[network.places]


@given(networks())
def test_positions_are_linked_where_loops_lead_from_one_place_to_the_other(network: Network) -> None:
    ours, oracle = network.spots, spots_of(network)
    assert ((ours[:, None] == ours) == (oracle[:, None] == oracle)).all()


def test_a_robot_may_go_on_as_the_path_did_when_it_came_back() -> None:
    """One path whose place 7 is its place 2: from 1 on it comes to 3, or to 8."""
    network = Network(
        (np.arange(10.0),),
        np.arange(10),
        MotionSettings(slack=0.1, drift=0.0, tail=1e-9),
        ChainSettings(lost=0.0),
        0.5,
        np.array([[2, 7]]),
    )
    states = np.zeros((2, 10))
    states[0, 1] = 1.0
    for _ in range(2):
        states = network.transitions(1.0).predict(states)
    assert states[0, [3, 8]] == pytest.approx([0.75, 0.25])
    assert states.sum() == pytest.approx(1.0)


def test_without_links_a_path_leads_to_no_other() -> None:
    paths = (np.arange(4.0), np.arange(3.0))
    matrix = dense(Network(paths, np.arange(7), MotionSettings(), SETTINGS), 1.0)
    one, other = [0, 1, 2, 3, 8, 9, 10], [4, 5, 6, 11, 12, 13]  # Lost_0, which is common to all, left out
    assert matrix[np.ix_(one, other)].max() == 0
    assert matrix[np.ix_(other, one)].max() == 0


def test_what_is_at_a_shared_place_may_go_on_along_either_path() -> None:
    paths = (np.arange(5.0), np.arange(5.0))
    # Position 2 of the first and position 2 of the second are one place.
    places = np.array([0, 1, 2, 3, 4, 5, 6, 2, 7, 8])
    network = Network(paths, places, MotionSettings(slack=0.1, drift=0.0, tail=1e-9), ChainSettings(lost=0.0), 0.5)
    states = np.zeros((2, 10))
    states[0, 1] = 1.0
    for _ in range(2):
        states = network.transitions(1.0).predict(states)
    assert states[0, [3, 8]] == pytest.approx([0.75, 0.25])
    assert states.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("crossing", [0.0, 0.2, 1.0])
def test_the_share_that_crosses_is_shared_out_evenly_among_linked_positions(crossing: float) -> None:
    """Position 1 of the first path and of the second are one place; half of what crosses comes back."""
    paths, places = (np.arange(3.0), np.arange(3.0)), np.array([0, 1, 2, 3, 1, 4])
    network = Network(paths, places, MotionSettings(slack=0.0, tail=0.0), ChainSettings(lost=0.0), crossing)
    states = np.zeros((2, 6))
    states[0, 1] = 1.0
    expected = [0, 1 - crossing / 2, 0, 0, crossing / 2, 0]
    assert network.transitions(0.0).predict(states)[0] == pytest.approx(expected)
