"""Figures that need no truth, on answers made by hand, against sums done by hand and against least squares."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.belief import Stage, belief_from
from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.consistency.answers import given_answers, odometric_places
from refseq_bench.scenarios.scoring.consistency.consistency import Consistency, consistency, pool_consistency
from refseq_bench.scenarios.scoring.consistency.jumps import excess
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.path_geometry import LengthUnit, Tolerance
from refseq_bench.scenarios.scoring.proportion import Proportion
from tests.support import certain

K, STEP = 60, 0.85


def drive(count: int, step: float = STEP) -> list[View]:
    """A drive of which only the odometry is known."""
    return [View(2.0 * t, distance=step) for t in range(count)]


def told(
    places: Sequence[int],
    *,
    lost: Sequence[int] = (),
    step: float = STEP,
    learnt: float = STEP,
    **others: Sequence[int],
) -> Comparison:
    """A method's answers to a drive of ``step`` [m] a view, in a map of ``K`` places ``learnt`` [m] apart."""
    beliefs = {
        method: [certain(K, place, lost=0.9 if method == "one" and t in lost else 0.0) for t, place in enumerate(of)]
        for method, of in {"one": places, **others}.items()
    }
    return Comparison("blind", drive(K, learnt), {}, drive(len(places), step), {}, beliefs)


def of(places: Sequence[int], **how: Any) -> Consistency:
    return consistency(told(places, **how), "one")


def test_a_perfect_answer_never_jumps_and_follows_the_odometer() -> None:
    found = of(range(5, 45))
    assert found.jumps == Proportion(0, 39)
    assert found.lost == Proportion(0, 40)
    assert found.fit.slope == pytest.approx(1.0)
    assert found.fit.residual == pytest.approx(0.0, abs=1e-6)
    assert found.entropy == 0.0
    assert not found.agreement.trials


def test_shuffled_answers_jump_nearly_always() -> None:
    found = of(np.random.default_rng(1).permutation(K).tolist())
    assert found.jumps.value > 0.8
    assert found.jumps.trials == K - 1


def test_an_answer_that_stays_where_it_is_has_no_slope() -> None:
    found = of([20] * 40)
    assert found.jumps.successes == 0
    assert found.fit.slope == 0.0


def test_odometers_that_count_otherwise_show_in_the_slope() -> None:
    # The map's odometer counted 0.85 m where the query's counts 0.80 m, from place to place.
    assert of(range(40), step=0.80).fit.slope == pytest.approx(0.85 / 0.80)


def test_a_jump_begins_beyond_twice_the_tolerance() -> None:
    # 4 m a view; one step of the answers is 4 places of 1 m (0 m too many), then of 7 (3.0), then of 8 (4.0).
    comparison = told([0, 4, 11, 19], step=4.0, learnt=1.0)
    places, answers = odometric_places(comparison), given_answers(comparison, "one")
    assert excess(answers, places).tolist() == [0.0, 3.0, 4.0]
    assert consistency(comparison, "one").jumps == Proportion(1, 3)
    assert consistency(comparison, "one", Tolerance(1.49)).jumps == Proportion(2, 3)
    assert consistency(comparison, "one", Tolerance(2.0)).jumps == Proportion(0, 3)


@pytest.mark.parametrize("spacing", [0.1, 1.0, 10.0])
def test_a_jump_begins_beyond_twice_as_many_pictures(spacing: float) -> None:
    one_picture = Tolerance(1.0, unit=LengthUnit.FRAMES)
    comparison = told([0, 1, 3, 8], step=spacing, learnt=spacing)  # by 0, 1, and 4 places more than the robot went
    assert consistency(comparison, "one", one_picture).jumps == Proportion(1, 3)


def test_places_far_apart_allow_a_step_of_one_place() -> None:
    # The robot drives 1 m a view past places 10 m apart: the best place moves by one of them at once.
    assert of([t // 10 for t in range(40)], step=1.0, learnt=10.0).jumps == Proportion(0, 39)


def test_views_that_say_lost_are_left_out_and_the_way_between_counts() -> None:
    places = [*range(10), *[59] * 5, *range(15, 25)]
    found = of(places, lost=range(10, 15))
    assert found.lost == Proportion(5, 25)
    assert found.jumps == Proportion(0, 19)
    assert found.fit.slope == pytest.approx(1.0)
    assert of(places).jumps == Proportion(2, 24)


def test_a_kidnap_is_one_jump_and_leaves_the_slope_as_it_was() -> None:
    found = of([*range(10, 30), *range(40, 59)])
    assert found.jumps == Proportion(1, 38)
    assert (found.fit.slope, found.fit.residual) == pytest.approx((1.0, 0.0), abs=1e-6)


def test_a_robot_that_reverses_goes_back_along_the_map() -> None:
    there, back = drive(20), drive(20, -STEP)
    answers = [certain(K, place) for place in (*range(20), *range(18, -1, -1), 0)]
    query = [*there, *back[:19], replace(back[0], distance=0.0)]
    found = consistency(Comparison("back", drive(K), {}, query, {}, {"one": answers}), "one")
    assert found.jumps == Proportion(0, 39)
    assert found.fit.slope == pytest.approx(1.0)


def test_slope_and_residual_of_four_answers_by_hand() -> None:
    """Places 0, 1, 3, 3 m at ways 0, 1, 2, 3 m: sums around the means of 5, 5.5 and 6.75 m²."""
    fit = of([0, 1, 3, 3], step=1.0, learnt=1.0).fit
    assert fit.slope == pytest.approx(5.5 / 5)
    assert fit.residual == pytest.approx(math.sqrt((6.75 - 5.5**2 / 5) / 4))


def test_a_robot_has_travelled_its_ways_back_too_and_those_while_it_said_lost() -> None:
    query = [View(float(t), distance=step) for t, step in enumerate([0.0, 1.0, -1.0, 1.0, -1.0])]
    answers = given_answers(replace(told([5] * 5, lost=[1, 3]), query_views=query), "one")
    assert answers.views.tolist() == [0, 2, 4]
    assert answers.travelled.tolist() == [0.0, 2.0, 4.0]
    assert answers.odometer.tolist() == [0.0, 0.0, 0.0]


# Mostly on by a place or so, as answers do, so that runs are long; now and then far off.
steps_of_places = st.sampled_from([-1, 0, 1, 1, 1, 2, 2, 20, -20])


@given(
    st.integers(0, K - 1),
    st.lists(st.tuples(steps_of_places, st.floats(-1.0, 2.0), st.booleans()), min_size=2, max_size=40),
)
def test_slope_and_residual_are_those_of_least_squares_with_an_intercept_a_run(
    first: int, made: list[tuple[int, float, bool]]
) -> None:
    moves, steps, is_lost = zip(*made, strict=True)
    places = ((first + np.cumsum(moves)) % K).tolist()
    query = [View(float(t), distance=step) for t, step in enumerate(steps)]
    beliefs = {"one": [certain(K, place, lost=float(lost)) for place, lost in zip(places, is_lost, strict=True)]}
    found = consistency(Comparison("any", drive(K), {}, query, {}, beliefs), "one")

    given_at = [t for t, lost in enumerate(is_lost) if not lost]
    s = np.cumsum([0.0, *steps[1:]])
    travelled = np.cumsum(np.abs([0.0, *steps[1:]]))
    runs: list[list[int]] = []
    jumps = 0
    for t in given_at:
        moved = abs(places[t] - places[runs[-1][-1]]) * STEP if runs else math.inf
        way = travelled[t] - travelled[runs[-1][-1]] if runs else 0.0
        if runs and moved - way <= 3.0:
            runs[-1].append(t)
        else:
            jumps += bool(runs)
            runs.append([t])
    if not any(steps[1:]):
        assert found.jumps.trials == 0
        assert math.isnan(found.fit.slope)
        return
    assert found.jumps == Proportion(jumps, max(len(given_at) - 1, 0))
    rows = [(t, number) for number, run in enumerate(runs) if len(run) > 1 for t in run]
    design = np.array([[s[t], *(float(number == n) for n in range(len(runs)))] for t, number in rows])
    if not len(rows) or np.linalg.norm([s[t] - np.mean([s[u] for u in runs[n]]) for t, n in rows]) < 1e-3:
        return  # nowhere to go: there is no line
    target = np.array([places[t] * STEP for t, _ in rows])
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    left = target - design @ solution
    assert found.fit.slope == pytest.approx(solution[0], rel=1e-6, abs=1e-6)
    assert found.fit.residual == pytest.approx(math.sqrt(np.mean(left**2)), rel=1e-6, abs=1e-4)


def test_a_drive_without_odometry_has_no_jumps_to_tell_of() -> None:
    for how in ({"step": 0.0}, {"learnt": 0.0}):
        found = of(range(40), **how)
        assert found.jumps == Proportion(0, 0)
        assert math.isnan(found.fit.slope)
        assert math.isnan(found.fit.residual)


def test_an_odometer_that_was_assumed_is_none() -> None:
    pictures = {"odometry": "assumed: 1 m a picture"}
    blind = replace(told(range(40)), reference_metadata=pictures, query_metadata=pictures)
    assert consistency(blind, "one").jumps == Proportion(0, 0)
    assert math.isnan(consistency(blind, "one").fit.slope)


def test_steps_between_drives_are_not_measured() -> None:
    comparison = replace(told([*range(10, 30), *range(30, 50)]), drives=Drives(("a", "b"), (30, 30)))
    found = consistency(comparison, "one")
    assert found.jumps == Proportion(0, 38)
    assert found.fit.slope == pytest.approx(1.0)
    assert odometric_places(comparison).along[30] == 0.0


def test_methods_agree_within_the_tolerance_along_the_map() -> None:
    one = list(range(10, 20))
    other = [place + off for place, off in zip(one, [0, 1, -1, 2, -2, 0, 0, 9, -9, 1], strict=True)]
    comparison = told(one, lost=[0], other=other)
    # Two places are 1.7 m: beyond 1.5 m, within 2 m. View 0 is no answer of both.
    assert consistency(comparison, "one").agreements == {"other": Proportion(5, 9)}
    assert consistency(comparison, "other").agreements == {"one": Proportion(5, 9)}
    assert consistency(comparison, "one", Tolerance(2.0)).agreement == Proportion(7, 9)
    # Without odometry places are counted: two apart still agree.
    blind = told(one, lost=[0], learnt=0.0, other=other)
    assert consistency(blind, "one").agreement == Proportion(7, 9)
    for pictures, agreed in ((1.0, 5), (2.0, 7), (9.0, 9)):  # of a tolerance in pictures places are counted always
        frames = Tolerance(pictures, unit=LengthUnit.FRAMES)
        found = [
            consistency(each, "one", frames).agreement
            for each in (comparison, blind, told(one, lost=[0], learnt=0.1, other=other))
        ]
        assert found == [Proportion(agreed, 9)] * 3


def test_a_place_taken_out_is_at_the_one_that_holds_it() -> None:
    # Places 30 to 59 are the second drive's; where the first method has merged, its place 5 holds the other's 35.
    comparison = replace(told([5] * 4, other=[35] * 4), drives=Drives(("a", "b"), (30, 30)))
    assert consistency(comparison, "one").agreement == Proportion(0, 4)
    held_by = np.arange(K)
    held_by[35] = 5
    merged = replace(comparison, mergings={"one": Merging(("a", "b"), (30, 30), held_by, (), (1, 1), 0.0)})
    assert consistency(merged, "one").agreement == consistency(merged, "other").agreement == Proportion(4, 4)


def test_entropy_is_the_views_mean() -> None:
    two = belief_from([1.0, 1.0] + [0.0] * (K - 2))
    comparison = replace(told([0, 0]), beliefs={Stage.CHAIN: [two, certain(K, 0)]})
    assert consistency(comparison, Stage.CHAIN).entropy == pytest.approx(math.log(2) / 2)
    empty = Comparison("none", drive(K), {}, [], {}, {Stage.CHAIN: []})
    assert math.isnan(consistency(empty, Stage.CHAIN).entropy)


def test_runs_are_pooled_by_their_views() -> None:
    first, second = of(range(30)), of([*range(10), 50, 51])
    whole = pool_consistency([first, second])
    assert whole.jumps == Proportion(1, 40)
    assert whole.lost == Proportion(0, 42)
    assert whole.fit.slope == pytest.approx(1.0)
    assert pool_consistency([first]) == first
