import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.belief import Timings, belief_from, entropy, normalised_entropy, pose_beside
from refseq.errors import RefseqError


@given(st.lists(st.floats(0, 1e300, allow_nan=False), min_size=1, max_size=9).filter(any), st.floats(0, 1))
def test_weights_become_probabilities_in_proportion(weights: list[float], lost: float) -> None:
    belief = belief_from(weights, lost)
    assert belief.places.dtype == np.float64
    assert math.isclose(math.fsum(belief.places), 1, rel_tol=1e-12)
    total = math.fsum(weight / max(weights) for weight in weights)
    np.testing.assert_allclose(belief.places, [weight / max(weights) / total for weight in weights], rtol=1e-12)
    assert belief.best == weights.index(max(weights))
    assert belief.path == (belief.best,)
    assert belief.lost == lost
    assert 0 <= belief.entropy <= math.log(len(weights)) + 1e-9


def test_entropy_is_what_one_computes_by_hand() -> None:
    assert belief_from([1, 1, 2, 0]).entropy == pytest.approx(1.5 * math.log(2))
    assert belief_from([0, 7]).entropy == 0


def test_what_is_given_is_kept() -> None:
    weights = np.array([1.0, 3.0])
    belief = belief_from(weights, 0.25, best=0, path=(1, -1, 0), timings=Timings(chain=2.0))
    assert (belief.best, belief.path, belief.timings.total) == (0, (1, -1, 0), 2.0)
    weights[0] = 9
    assert belief.places[0] == 0.25


def test_beliefs_are_the_same_whatever_time_they_took() -> None:
    """So that two runs can be compared by =="""
    one = belief_from([1, 2, 3], 0.25, timings=Timings(chain=2.0), lost_after=np.array([0.1, 0.0, 0.1]))
    pose = pose_beside((0.1, 0.2, 0.3), np.eye(3))
    assert one == belief_from([1, 2, 3], 0.25, timings=Timings(chain=3.0), lost_after=np.array([0.1, 0.0, 0.1]))
    assert replace(one, pose=pose) == replace(one, pose=pose_beside((0.1, 0.2, 0.3), np.eye(3)))
    others = [
        belief_from([1, 2, 4], 0.25, lost_after=one.lost_after),
        replace(one, lost_after=None),
        replace(one, lost_after=np.array([0.1, 0.1, 0.0])),
        replace(one, odometer_scale=0.8),
        replace(one, pose=pose),
        "one",
    ]
    assert [one == other for other in others] == [False] * len(others)
    assert replace(one, pose=pose) != replace(one, pose=pose_beside((0.1, 0.2, 0.3), 2 * np.eye(3)))


@pytest.mark.parametrize("weights", [[], [0, 0], [1, -1], [1, math.nan], [math.inf, 1], [[1, 2]], 3.0])
def test_what_makes_no_probabilities_is_told(weights: object) -> None:
    with pytest.raises(RefseqError, match=r"^belief: weights of shape .* not all 0$"):
        belief_from(weights)


@pytest.mark.parametrize("lost", [-0.1, 1.1, math.nan])
def test_lost_is_a_probability(lost: float) -> None:
    with pytest.raises(RefseqError, match=r"^belief: lost = .* it should be from 0 to 1$"):
        belief_from([1.0], lost)


def test_entropy_by_hand() -> None:
    assert entropy(np.array([0.5, 0.5, 0.0])) == pytest.approx(math.log(2))
    assert normalised_entropy(np.full(9, 1 / 9)) == pytest.approx(1.0)
    assert normalised_entropy(np.array([1.0])) == 0.0
    assert entropy(np.array([0.0, 1.0])) == 0.0


@pytest.mark.parametrize(
    ("lost", "after", "sure"),
    [
        (0.9, [0.1, 0.5, 0.0], 1),
        (0.9, [0.1, 0.3, 0.0], None),  # more probably than not nothing is known of where it was
        (0.9, [0.0, 0.0, 0.0], None),
        (0.5, [0.1, 0.4, 0.0], None),  # it does not say lost
        (0.9, None, None),
    ],
)
def test_it_was_last_sure_where_it_most_probably_got_lost(lost: float, after: list[float] | None, sure: object) -> None:
    belief = belief_from([1, 0, 0], lost, lost_after=None if after is None else np.array(after))
    assert belief.last_sure == sure


@pytest.mark.parametrize(
    ("weights", "modes"),
    [
        ([0, 0, 1, 0], [(2, 1.0)]),
        ([1, 3, 1, 0, 0, 4, 1], [(1, 0.5), (5, 0.5)]),  # two corridors that look alike
        ([6, 0.1, 0, 3.9, 0], [(0, 0.61), (3, 0.39)]),
        ([960, 0, 40, 0], [(0, 0.96)]),  # a run of less than 0.05 is none
        ([960, 9, 31, 0], [(0, 0.96)]),  # a place below 0.01 of the highest parts what it lies between
        ([1, 1, 1, 1], [(0, 1.0)]),
        ([1, 0] * 30, []),
    ],
)
def test_modes_are_runs_of_likely_places(weights: list[float], modes: list[tuple[int, float]]) -> None:
    found = belief_from(weights).modes
    assert [mode.best for mode in found] == [best for best, _ in modes]
    assert [mode.probability for mode in found] == pytest.approx([probability for _, probability in modes])


def test_no_mode_runs_on_into_the_next_sequence() -> None:
    belief = belief_from([0, 0, 2, 1, 0, 0])
    assert belief.modes == ((2, 1.0),)
    assert [mode.best for mode in belief.modes_in([0, 3])] == [2, 3]
    assert belief.modes_in([0, 2, 6]) == belief.modes


@given(st.lists(st.floats(0, 1), min_size=1, max_size=19).filter(any))  # the best of so few is no less than a mode
def test_modes_part_the_belief_and_the_best_place_leads_one(weights: list[float]) -> None:
    belief = belief_from(weights)
    modes = belief.modes
    assert math.fsum(mode.probability for mode in modes) <= 1 + 1e-9
    assert [mode.probability for mode in modes] == sorted((mode.probability for mode in modes), reverse=True)
    assert len({mode.best for mode in modes}) == len(modes)
    assert belief.best in {mode.best for mode in modes}
