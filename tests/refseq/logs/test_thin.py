import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.behaviours import begun
from refseq.logs.thin import OdometryNoise, chosen, every, with_odometry_noise
from refseq.view import View

quick = settings(derandomize=True)
motions = st.lists(st.tuples(st.floats(-0.5, 0.9), st.floats(-0.3, 0.3)), max_size=40)


def drive(motions: list[tuple[float, float]]) -> list[View]:
    return [View(float(k), distance=d, turn=t) for k, (d, t) in enumerate(motions)]


@quick
@given(motions, st.floats(0.1, 2))
def test_motion_is_conserved_and_views_are_apart(motions: list[tuple[float, float]], spacing: float) -> None:
    views = drive(motions)
    kept = every(views, spacing)
    assert [view.time for view in kept[:1]] == [view.time for view in views[:1]]
    assert [(v.distance, v.turn) for v in kept[:1]] == [(0.0, 0.0)] * len(kept[:1])
    for view in kept[1:]:
        assert abs(view.distance) >= spacing
    for before, after in pairwise(kept):
        between = views[int(before.time) + 1 : int(after.time) + 1]
        assert after.distance == pytest.approx(sum(view.distance for view in between), abs=1e-9)
        assert after.turn == pytest.approx(sum(view.turn for view in between), abs=1e-9)
        # It is the first one that is far enough.
        sums = np.cumsum([view.distance for view in between])[:-1]
        assert (np.abs(sums) < spacing + 1e-9).all()


@pytest.mark.parametrize("step", [0.25, -0.25])
def test_turning_on_the_spot_keeps_views_too(step: float) -> None:
    views = drive([(0.0, step)] * 13)
    assert [view.time for view in every(views, 0.85, turn=0.75)] == [0, 3, 6, 9, 12]
    assert [view.time for view in every(views, 0.85)] == [0]


def test_motion_of_views_between_chosen_ones_is_added_up() -> None:
    views = drive([(1.0, 0.25)] * 6)
    assert [(view.time, view.distance, view.turn) for view in chosen(views, [1, 4])] == [(1, 0, 0), (4, 3.0, 0.75)]
    assert chosen(views, []) == ()


def told(behaviours: dict[int, str], count: int = 12) -> list[View]:
    return [replace(view, behaviour=behaviours.get(k, "")) for k, view in enumerate(drive([(0.3, 0.0)] * count))]


def test_behaviours_told_at_views_that_go_are_told_at_their_metres_behind_the_one_before() -> None:
    views = told({0: "MN:8", 4: "MT:90", 5: "MN:3; MT:5@0.1", 6: "MN:5", 11: "MA"})
    wanted = ["MN:8", "MT:90@0.30; MN:3@0.60; MT:5@0.70", "MN:5", "MA@0.60"]
    assert [view.behaviour for view in every(views, 0.85)] == wanted
    assert [view.behaviour for view in chosen(views, [0, 3, 6, 9])] == wanted
    learnt = [(0.9 * n + offset, behaviour) for n, words in enumerate(wanted) for offset, behaviour in begun(words)]
    assert [at for at, _ in learnt] == pytest.approx([0.0, 1.2, 1.5, 1.6, 1.8, 3.3])


def test_the_first_view_chosen_goes_on_with_what_was_told_before_it() -> None:
    views = told({0: "MN:8", 2: "MT:90", 5: "MN:5"})
    assert [view.behaviour for view in chosen(views, [3, 6])] == ["MT:90; MN:5@0.60", ""]
    assert [view.behaviour for view in chosen(views, [5, 6])] == ["MN:5", ""]


def test_words_that_begin_nowhere_stay_as_they_are() -> None:
    assert [view.behaviour for view in every(told({1: "go @home"}), 0.85)][:2] == ["go @home", ""]


@pytest.mark.parametrize("turned", [0.2, -0.2])
def test_noise_has_the_stated_deviations(turned: float) -> None:
    views = drive([(0.5, turned)] * 4000)
    noisy = with_odometry_noise(views, np.random.default_rng(1), OdometryNoise(distance=0.1, turn=0.05, drift=0.02))
    distance = np.array([view.distance for view in noisy]) - 0.5
    turn = np.array([view.turn for view in noisy]) - turned
    # Of 4000 draws the deviation is right within 1.1 %, the mean within 1.6 % of it, at one sigma.
    for error, sigma in ((distance, 0.1 * 0.5), (turn, 0.05 * 0.2 + 0.02 * 0.5)):
        assert error.std() == pytest.approx(sigma, rel=0.05)
        assert abs(error.mean()) < 0.06 * sigma
    assert abs(np.corrcoef(distance, turn)[0, 1]) < 0.06


def test_noise_is_seeded_and_spares_a_standing_robot() -> None:
    views = drive([(0.0, 0.0), (1.0, 0.0), (-1.0, 0.5)])
    first, again, other = (with_odometry_noise(views, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert (first[0].distance, first[0].turn) == (0.0, 0.0)
    assert math.copysign(1, first[2].distance) == -1
