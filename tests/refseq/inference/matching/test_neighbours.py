import numpy as np
import pytest

from refseq.inference.matching.neighbours import GAP, REACH, STEPS, Neighbours


def test_on_an_even_path_places_are_neighbours_by_their_numbers() -> None:
    for along in (0.8 * np.arange(9.0), 12.0 * np.arange(9.0), np.cumsum([0, 0.1, 3.9, 0.2, 0.3, 1, 2, 3, 1])):
        found, even = Neighbours.of(along), Neighbours.even(9)
        for name in ("step", "first", "last"):
            np.testing.assert_array_equal(getattr(found, name), getattr(even, name))
        assert found.stretches == 1


def test_without_odometry_places_are_neighbours_by_their_numbers() -> None:
    np.testing.assert_array_equal(Neighbours.of(np.zeros(4)).step, np.arange(4))
    np.testing.assert_array_equal(Neighbours.of(np.zeros(1)).step, [0])


def test_places_of_a_stand_are_one_step_and_a_gap_is_farther_than_anything_reaches() -> None:
    found = Neighbours.of(np.array([0.0, 1, 1, 1, 2, 30, 31]))
    np.testing.assert_array_equal(found.step, [0, 1, 1, 1, 2, 3 + REACH, 4 + REACH])
    np.testing.assert_array_equal(found.views[[0, 1, 2]], [1, 3, 1])
    np.testing.assert_array_equal(found.first, [0] * 5 + [5] * 2)
    np.testing.assert_array_equal(found.last, [4] * 5 + [6] * 2)
    assert found.stretches == 2


@pytest.mark.parametrize("spacing", [0.1, 0.5, 2.0, 20.0])
def test_a_gap_is_far_in_metres_and_in_usual_steps(spacing: float) -> None:
    longest = max(GAP, STEPS * spacing)
    for way, stretches in ((0.99 * longest, 1), (1.01 * longest, 2)):
        along = spacing * np.arange(20.0)
        along[10:] += way - spacing
        assert Neighbours.of(along).stretches == stretches
