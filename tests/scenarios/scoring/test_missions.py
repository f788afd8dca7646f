"""Oracles of the score of missions: tracks made by hand, of which everybody can tell how they went."""

import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.missions.log import Touch
from refseq_bench.scenarios.scoring.missions import (
    MissionFigures,
    MissionRun,
    Ordered,
    barn,
    mission_record,
    outcome_words,
    score_mission,
)

SPEED = 0.5


def straight(length: float, offset: float = 0.0) -> np.ndarray:
    """A track along x at half a metre a second, ``offset`` beside the way."""
    times = np.arange(0, length / SPEED + 1e-9, 0.04)
    zeros = np.zeros_like(times)
    return np.stack([times, SPEED * times, zeros + offset, zeros, SPEED * times], axis=1)


ORDERS = (
    Ordered(0.0, "MN", "as learnt", np.array([[0.0, 0.0], [6.0, 0.0]])),
    Ordered(6.0, "MT:90", "as learnt", np.array([[6.0, 0.0]])),
)
RUN = MissionRun(
    completed=True,
    why="",
    track=straight(6.0),
    orders=ORDERS,
    switches=((0, 0.0), (1, 12.0)),
    log=(),
    goal=(6.0, 0.0),
    way=6.0,
    ideal=12.0,
    optimal=6.0,
    views=7,
)


def scored(**changed: object) -> MissionFigures:
    return MissionFigures("m", (score_mission(replace(RUN, **changed), 1.5, 0.5),))  # type: ignore[arg-type]


def test_a_mission_that_went_as_it_should() -> None:
    found = score_mission(RUN, 1.5, 0.5)
    assert (found.completed, found.completed_narrow, found.wrong) == (True, True, (False, False))
    assert found.goal_distance == pytest.approx(0.0)
    assert found.time == pytest.approx(12.0)
    assert found.barn == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("goal", "says", "wide", "narrow"),
    [
        ((6.0, 0.4), True, True, True),
        ((6.0, 1.4), True, True, False),
        ((6.0, 1.6), True, False, False),
        ((6.0, 0.0), False, False, False),
    ],
)
def test_completed_is_what_the_robot_says_and_what_is_true(
    goal: tuple[float, float], says: bool, wide: bool, narrow: bool
) -> None:
    found = score_mission(replace(RUN, goal=goal, completed=says), 1.5, 0.5)
    assert (found.completed, found.completed_narrow) == (wide, narrow)
    assert found.goal_distance == pytest.approx(goal[1])


@pytest.mark.parametrize(("time", "wrong"), [(12.0, False), (9.1, False), (8.9, True), (2.0, True)])
def test_a_turn_that_is_begun_too_early_is_a_wrong_switch(time: float, wrong: bool) -> None:
    """At half a metre a second the robot is 1.5 m before the corner after 9 s."""
    assert score_mission(replace(RUN, switches=((0, 0.0), (1, time))), 1.5, 0.5).wrong == (False, wrong)


def test_what_lasts_until_a_place_is_reached_may_be_begun_anywhere_on_its_stretch_and_nowhere_else() -> None:
    assert scored(switches=((0, 6.0),)).wrong_switches == 0
    assert scored(switches=((0, 6.0),), track=straight(6.0, offset=1.6)).wrong_switches == 1


def test_where_nobody_knows_what_was_right_there_is_no_wrong_switch_to_count() -> None:
    found = scored(orders=(Ordered(math.nan, "CROSS", "", np.zeros((0, 2))),), switches=((0, 0.0),))
    assert math.isnan(found.wrong_switches)
    assert mission_record(found)["wrong_switches"] is None


@pytest.mark.parametrize(("time", "metric"), [(1.0, 0.25), (40.0, 0.25), (50.0, 0.2), (80.0, 0.125), (1000.0, 0.125)])
def test_the_metric_of_the_barn_challenge(time: float, metric: float) -> None:
    """OT = 10 s: full marks up to 40 s, half of them from 80 s on."""
    assert barn(time, 10.0, success=True) == pytest.approx(metric)
    assert barn(time, 10.0, success=False) == 0.0


def test_who_touches_something_has_completed_the_mission_but_not_succeeded_in_the_challenge() -> None:
    found = scored(touches=(Touch(1.0, "wall-left"), Touch(2.0, "bin")))
    assert found.completed.successes == 1
    assert (found.collisions, found.barn) == (2, 0.0)


def test_figures_are_pooled_with_what_they_are_of() -> None:
    later = RUN.track[-1:] + np.array([[12.0, 0, 0, 0, 0]])
    late = replace(RUN, track=np.concatenate([RUN.track, later]))
    failed = replace(RUN, completed=False, why="failed: lost for 30 s", goal=(6.0, 9.0), lost=2)
    found = MissionFigures("m", tuple(score_mission(one, 1.5, 0.5) for one in (RUN, late, failed)))
    record = mission_record(found)
    assert record["completed"] == "2 of 3"
    assert record["wrong_switches"] == "0 of 6"
    assert record["time_median_s"] == pytest.approx(18.0), "of those that were completed: 12 and 24 s"
    assert record["time_over_ideal_median"] == pytest.approx(1.5)
    assert record["goal_distance_median_m"] == pytest.approx(0.0)
    assert (record["lost_times"], record["views"]) == (2, 21)
    assert record["barn_mean"] == pytest.approx((0.25 + 0.25 + 0.0) / 3, abs=1e-4)


def test_a_goal_that_nobody_knows_is_left_out_of_the_distance() -> None:
    runs = (RUN, replace(RUN, completed=False, refused=True, goal=(math.nan, math.nan)))
    found = MissionFigures("m", tuple(score_mission(one, 1.5, 0.5) for one in runs))
    assert (found.goal_distance, found.refused, found.completed.successes) == (pytest.approx(0.0), 1, 1)
    assert mission_record(MissionFigures("m", found.scores[1:]))["goal_distance_median_m"] is None


def test_without_a_completed_mission_there_is_no_time() -> None:
    found = mission_record(scored(completed=False, why="failed: no room"))
    assert (found["time_median_s"], found["time_over_ideal_median"]) == (None, None)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, "completed in 12 s, 0.00 m from the goal"),
        ({"goal": (6.0, 4.0)}, "took itself to be there, 4.00 m from the goal"),
        ({"completed": False, "why": "failed: no room"}, "failed: no room (0.00 m from the goal)"),
        ({"completed": False, "why": "refused: no door", "goal": (math.nan, math.nan)}, "refused: no door"),
    ],
)
def test_outcomes_in_words(changed: dict[str, object], told: str) -> None:
    run = replace(RUN, **changed)  # type: ignore[arg-type]
    assert outcome_words(run, score_mission(run, 1.5, 0.5)) == told
