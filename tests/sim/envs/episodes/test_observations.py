"""Observations: shapes, and what becomes of readings that are no numbers."""

import math

import numpy as np
import pytest
from gymnasium import spaces

from refseq.belief import belief_from
from refseq.view import Scan
from refseq_bench.robots import Blocked, Cause, RobotState, Stop, Twist
from refseq_bench.sim.envs.episodes.observations import (
    Known,
    Sensing,
    asked,
    by_place,
    goal,
    odometry,
    one_hot,
    ranges,
    stops,
    summary,
)

ALONG = np.array([0.0, 1.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("measured", "given"),
    [(np.inf, 8.0), (np.nan, 8.0), (-np.inf, 0.0), (-0.1, 0.0), (3.25, 3.25), (8.0, 8.0), (9.0, 8.0)],
)
def test_a_range_that_is_no_number_is_the_farthest(measured: float, given: float) -> None:
    seen = ranges(np.array([measured]), np.float32(8.0))
    assert seen.dtype == np.float32
    assert seen.tolist() == [given]


def test_odometry_that_is_no_number_is_none_and_large_ones_are_cut_off() -> None:
    assert odometry([math.nan, math.inf, -math.inf, 0.5, 0.25]).tolist() == [0.0, 6.0, -3.0, 0.5, 0.25]


@pytest.mark.parametrize(
    ("stop", "told"),
    [
        (None, [0, 0, 0]),
        (Stop(Cause.SONAR, "", 0.0, Blocked.FORWARD), [1, 0, 0]),
        (Stop(Cause.BUMPER, "", 0.0, Blocked.BACKWARD), [0, 1, 1]),
        (Stop(Cause.TIPPED, "", 0.0, Blocked.ALL), [1, 1, 0]),
    ],
)
def test_stops_tell_which_way_is_forbidden(stop: Stop | None, told: list[float]) -> None:
    assert stops(RobotState(stops=(stop,) if stop else ())).tolist() == told


def test_a_belief_in_five_numbers() -> None:
    belief = belief_from([1.0, 2.0, 4.0, 1.0], lost=0.25)
    entropy = -sum(p * math.log(p) for p in (0.125, 0.25, 0.5, 0.125)) / math.log(4)
    expected = (0.25 * 1 + 0.5 * 2 + 0.125 * 3) / 3
    assert summary(belief).tolist() == pytest.approx([0.25, entropy, 2 / 3, 0.5, expected], rel=1e-6)


def test_a_belief_by_place_is_a_distribution_with_the_lost_place_last() -> None:
    assert by_place(belief_from([1.0, 3.0], lost=0.2)).tolist() == pytest.approx([0.2, 0.6, 0.2])


def test_the_expected_way_to_the_goal_is_negative_behind_it() -> None:
    belief = belief_from([0.0, 0.0, 1.0, 1.0])
    assert goal(belief, Known(ALONG, 1)).tolist() == pytest.approx([1 / 3, (1.0 - 3.0) / 4.0])


@pytest.mark.parametrize("form", ["summary", "places"])
def test_an_observation_is_in_the_space_and_shares_nothing_with_what_it_is_made_of(form: str) -> None:
    sensing = Sensing(sonars=2, max_range=80.0, cameras=("eye",), places=len(ALONG), belief=form, goal=True)
    scan, sonar = Scan(np.full(361, 5.0, np.float32)), np.array([1.0, np.nan])
    image = np.zeros((480, 640), np.uint8)
    state = RobotState(twist=Twist(0.4, 0.1), sonar=sonar)
    belief = belief_from([1.0, 2.0, 3.0, 4.0]), Known(ALONG, 3)
    seen = sensing.observed(scan, state, (0.1, 0.0, 0.02), belief=belief, images={"eye": image})
    assert seen in sensing.space
    assert isinstance(sensing.space, spaces.Dict)
    assert set(seen) == {"scan", "sonar", "odometry", "stops", "belief", "goal", "eye"}
    sources = (scan.ranges, sonar, image)
    assert not any(np.shares_memory(part, source) for part in seen.values() for source in sources)
    assert seen["sonar"].tolist() == pytest.approx([1.0, 10.668])
    assert seen["odometry"].tolist() == pytest.approx([0.4, 0.1, 0.1, 0.0, 0.02])


def test_a_robot_that_was_not_heard_yet_hears_nothing() -> None:
    sensing = Sensing(sonars=3, max_range=80.0)
    seen = sensing.observed(Scan(np.full(361, np.inf, np.float32)), RobotState(), (0.0, 0.0, 0.0))
    assert seen["sonar"].tolist() == pytest.approx([10.668] * 3)
    assert seen["scan"].max() == 80.0


def test_what_is_asked_begins_with_what_is_due_where_the_robot_expects_to_be() -> None:
    plan = [(0.0, 0), (1.5, 2), (3.0, 1), (3.5, 3)]
    held = belief_from(np.array([0.0, 0.5, 0.5, 0.0]))  # at 1.5 m
    seen = asked(held, Known(ALONG, asked=plan), 4)
    assert seen.dtype == np.float32
    assert seen.tolist() == [[0.0, 0, 0, 1, 0], [1.5, 0, 1, 0, 0], [2.0, 0, 0, 0, 1]]
    gone = asked(held, Known(ALONG, asked=plan, gone=1.5), 4)  # at 3 m by now
    assert gone.tolist() == [[0.0, 0, 1, 0, 0], [0.5, 0, 0, 0, 1], [0.0, 0, 0, 0, 0]]
    assert asked(belief_from(np.eye(4)[0]), Known(ALONG, asked=plan), 4)[:, 0].tolist() == [0.0, 1.5, 3.0]


def test_one_hot_has_one_place_or_none() -> None:
    assert one_hot(2, 4).tolist() == [0, 0, 1, 0]
    assert one_hot(None, 4).tolist() == [0, 0, 0, 0]
