"""Lines, lanes, room and walls of behaviours against geometry that is worked out otherwise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.robots import Limits, PlanarPose, RobotState, Shape, Twist
from refseq_bench.robots.behaviours import Ranger, RobotDescription, Senses
from refseq_bench.robots.behaviours.moves import driven
from refseq_bench.robots.behaviours.sensing.lanes import LANE_MARGIN, choose_lane, lanes
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.room import LOOK, MARGIN, blocks_turn, free_ahead
from refseq_bench.robots.behaviours.sensing.sonar_filter import HISTORY
from refseq_bench.robots.behaviours.sensing.sonar_ring import SonarEchoes
from refseq_bench.robots.behaviours.sensing.surroundings import CELL, thinned
from refseq_bench.robots.behaviours.sensing.wall import SearchWindow, find_wall
from refseq_bench.robots.behaviours.steering import EASE, speed_to_stop, turn_rate_onto
from refseq_bench.robots.planar import into, out_of
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

LONG_TAIL = Shape(ahead=0.33, behind=0.74, half_width=0.355, height=1.4)
coordinate = st.floats(-20, 20)
angle = st.floats(-4, 4)
poses = st.builds(PlanarPose, coordinate, coordinate, angle)


@given(poses, st.builds(DirectedLine, coordinate, coordinate, angle))
def test_a_line_sees_a_point_and_a_pose_alike_and_finds_back(pose: PlanarPose, line: DirectedLine) -> None:
    seen = line.pose(pose)
    assert line.seen(np.array([[pose.x, pose.y]]))[0] == pytest.approx((seen.x, seen.y), abs=1e-9)
    back = line.at(seen.x, seen.y, seen.heading)
    assert (back.x, back.y) == pytest.approx((pose.x, pose.y), abs=1e-9)
    assert math.remainder(back.heading - pose.heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert line.points(line.seen(np.array([[pose.x, pose.y]])))[0] == pytest.approx((pose.x, pose.y), abs=1e-9)


@given(poses, coordinate, coordinate)
def test_points_go_into_a_robots_frame_and_out_again(pose: PlanarPose, x: float, y: float) -> None:
    points = np.array([[x, y]])
    assert out_of(pose, into(pose, points)) == pytest.approx(points, abs=1e-9)
    assert np.hypot(*into(pose, points)[0]) == pytest.approx(math.dist((pose.x, pose.y), (x, y)), abs=1e-9)


def test_what_is_to_the_left_of_a_line_is_positive_and_the_robot_turns_right_to_it() -> None:
    error = DirectedLine(0.0, 0.0, math.pi / 2).pose(PlanarPose(-1.0, 2.0, math.pi / 2))
    assert (error.x, error.y, error.heading) == pytest.approx((2.0, 1.0, 0.0))
    assert turn_rate_onto(error) < 0 < turn_rate_onto(error, offset=2.0)


@pytest.mark.parametrize("start", [PlanarPose(0, 1.0, 0), PlanarPose(0, -2.0, 1.0), PlanarPose(0, 0, 3.0)])
def test_steering_brings_a_point_that_rolls_onto_its_line(start: PlanarPose) -> None:
    x, y, heading = start.x, start.y, start.heading
    for _ in range(3000):
        rate = turn_rate_onto(DirectedLine(0, 0, 0).pose(PlanarPose(x, y, heading)))
        heading += 0.01 * min(max(rate, -0.5), 0.5)
        x, y = x + 0.005 * math.cos(heading), y + 0.005 * math.sin(heading)
    assert (y, math.sin(heading)) == pytest.approx((0.0, 0.0), abs=1e-3)


@given(st.floats(0, 50), st.floats(0.1, 3), st.floats(0, 2))
def test_from_the_speed_to_stop_reaction_and_braking_take_the_distance(
    distance: float, acceleration: float, reaction: float
) -> None:
    speed = speed_to_stop(distance, acceleration, reaction)
    assert speed * reaction + speed**2 / (2 * EASE * acceleration) == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize("speed", [0.2, 0.5, 1.0])
def test_where_nothing_is_in_the_way_it_is_as_fast_as_its_limits_let_it(speed: float) -> None:
    frame = RobotDescription(LONG_TAIL, Limits(speed, 1.0, 0.5, 1.0), ON_THE_ROBUTER)
    assert driven(frame, np.empty((0, 2)), 0.0, left=10.0).twist == Twist(speed, 0.0)
    assert driven(frame, np.empty((0, 2)), 0.0, left=0.05).twist.linear <= 0.1


@pytest.mark.parametrize("away", [0.8, 1.5, 2.5])
def test_straight_ahead_it_is_free_up_to_the_margin_before_a_wall(away: float) -> None:
    wall = np.stack([np.full(100, away), np.linspace(-1, 1, 100)], axis=1)
    assert free_ahead(wall, LONG_TAIL, 0.0, LOOK) == pytest.approx(away - LONG_TAIL.ahead - MARGIN, abs=0.05)


def test_a_wall_beside_the_robot_is_none_ahead_but_the_tail_swings_into_it() -> None:
    wall = np.stack([np.linspace(-2, 4, 300), np.full(300, 0.45)], axis=1)
    assert free_ahead(wall, LONG_TAIL, 0.0, LOOK) == LOOK
    assert free_ahead(wall, LONG_TAIL, -2.0, LOOK) < 0.3
    assert free_ahead(wall, LONG_TAIL, -0.1, LOOK) == LOOK


def box(shape: Shape, heading: float, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points lie in the box of a robot that is turned by ``heading``, by its four edges as half planes."""
    front, rear, half = shape.ahead, -shape.behind, shape.half_width
    corners = [(front, -half), (front, half), (rear, half), (rear, -half)]
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    at = np.array(corners) @ turn.T
    inside = np.ones(len(points), bool)
    for one, other in zip(at, np.roll(at, -1, axis=0), strict=True):
        edge = other - one
        inside &= edge[0] * (points[:, 1] - one[1]) - edge[1] * (points[:, 0] - one[0]) > 0
    return inside


@given(st.floats(0, 2 * math.pi), st.floats(0.0, 1.2), st.floats(-2 * math.pi, 2 * math.pi))
def test_whatever_a_turning_robot_would_touch_is_in_its_way(bearing: float, away: float, turn: float) -> None:
    point = away * np.array([[math.cos(bearing), math.sin(bearing)]])
    touched = any(box(LONG_TAIL, part * turn, 1.05 * point).any() for part in np.linspace(0, 1, 200))
    beside = box(LONG_TAIL, 0.0, 0.9 * point).any()
    if touched and not beside:
        assert len(blocks_turn(point, LONG_TAIL, turn)) == 1
    if away > LONG_TAIL.swing + 0.1:
        assert len(blocks_turn(point, LONG_TAIL, turn)) == 0


def test_a_lane_leads_past_a_box_and_stays_where_there_is_none() -> None:
    offsets = lanes(0.0, -1.0, 1.0)
    thing = np.stack([np.full(20, 1.5), np.linspace(-0.2, 0.6, 20)], axis=1)
    assert choose_lane(np.empty((0, 2)), 0.0, LONG_TAIL, offsets) == 0.0
    assert choose_lane(thing + np.array([5.0, 0.0]), 0.0, LONG_TAIL, offsets) == 0.0
    lane = choose_lane(thing, 0.0, LONG_TAIL, offsets)
    assert lane == pytest.approx(-0.2 - LONG_TAIL.half_width - LANE_MARGIN, abs=0.06)
    # It stays in the lane until its tail has passed, and comes back then.
    assert choose_lane(thing, 1.5 + LONG_TAIL.behind - 0.01, LONG_TAIL, offsets) == lane
    assert choose_lane(thing, 1.5 + LONG_TAIL.behind + 0.01, LONG_TAIL, offsets) == 0.0


@given(st.floats(-0.2, 0.2), st.floats(0.4, 2.0), st.integers(0, 1000))
def test_a_wall_is_found_among_things_before_it_and_an_open_door(tilt: float, away: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    along = np.concatenate([np.linspace(-1, 1.5, 120), np.linspace(2.4, 5, 120)])  # a door of 0.9 m between
    wall = np.stack([along, np.full(len(along), away)], axis=1) + rng.normal(0, 0.005, (len(along), 2))
    cabinet = np.stack([np.linspace(0.3, 1.1, 60), np.full(60, away - 0.35)], axis=1)
    stray = rng.uniform((-1, 0), (5, 3), (20, 2))
    turn = np.array([[math.cos(tilt), math.sin(tilt)], [-math.sin(tilt), math.cos(tilt)]])
    points = np.concatenate([wall, cabinet, stray]) @ turn
    found = find_wall(points, DirectedLine(0, 0, 0), SearchWindow((-1.5, 5.0), (0.0, 3.5)), 0.6)
    assert found is not None
    assert found.line.heading == pytest.approx(tilt, abs=0.01)
    assert found.line.pose(PlanarPose(0, 0, 0)).y == pytest.approx(-away, abs=0.02)


def test_there_is_no_wall_in_a_few_points_nor_in_a_person() -> None:
    rng = np.random.default_rng(0)
    window = SearchWindow((-1.0, 5.0), (0.0, 2.5))
    assert find_wall(np.empty((0, 2)), DirectedLine(0, 0, 0), window, 0.6) is None
    assert find_wall(rng.uniform((0, 0), (5, 2), (10, 2)), DirectedLine(0, 0, 0), window, 0.6) is None
    bearing = np.linspace(0, 2 * math.pi, 100)
    person = np.stack([1 + 0.2 * np.cos(bearing), 1 + 0.2 * np.sin(bearing)], axis=1)
    assert find_wall(person, DirectedLine(0, 0, 0), window, 0.6) is None


def test_thinning_leaves_one_point_in_a_square() -> None:
    points = np.random.default_rng(0).uniform(0, 1, (5000, 2))
    thin = thinned(points)
    assert len(thin) == (1 / CELL) ** 2
    assert len(np.unique(np.floor(thin / CELL), axis=0)) == len(thin)


@given(points=st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=60), cell=st.sampled_from([CELL, 3.0]))
def test_thinning_is_the_mean_of_each_square_in_their_order(points: list[tuple[float, float]], cell: float) -> None:
    squares: dict[tuple[float, ...], list[tuple[float, float]]] = {}
    for x, y in points:
        squares.setdefault((math.floor(x / cell), math.floor(y / cell)), []).append((x, y))
    means = np.array([np.mean(squares[square], axis=0) for square in sorted(squares)])
    assert thinned(np.array(points), cell) == pytest.approx(means, abs=1e-12)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("far", [1e6, 1e18, 1e300])
def test_thinning_is_the_same_where_an_ill_odometer_is_far_off(far: float) -> None:
    """A million metres off the squares are the same; farther off all points are one to a float."""
    points = np.array([[0.0, 0.0], [0.01, 0.01], [1.0, 0.0]])
    thin = thinned(points + far)
    assert len(thin) == (2 if far < 1e9 else 1)
    assert thin.mean() == pytest.approx(far)


def test_an_echo_counts_that_is_heard_for_most_of_the_time_and_no_stray_one() -> None:
    """The second ranger hears a stray echo, which stays for a round of 0.4 s; then both hear a wall 1 m away."""
    echoes = SonarEchoes((Ranger(0.2, 0.0, 0.0), Ranger(0.0, 0.3, math.pi / 2)))

    def heard(time: float, *ranges: float) -> NDArray[np.float64]:
        return echoes.points(Senses(RobotState(time=time, sonar=np.array(ranges)), None, time))

    for k in range(30):
        heard(0.04 * k, math.inf, math.nan)
    assert [len(heard(1.2 + 0.04 * k, math.inf, 0.5)) for k in range(10)] == [0] * 10
    found = [heard(1.6 + 0.04 * k, 1.0, 1.0) for k in range(round(HISTORY / 0.04))]
    assert found[-1] == pytest.approx(np.array([[1.2, 0.0], [0.0, 1.3]]))
    assert len(found[0]) == 0


@pytest.mark.parametrize("none", [-1.0, math.nan, math.inf])
def test_a_reading_of_no_range_is_a_far_one(none: float) -> None:
    """An echo in a fifth of the time is stray, and in three fifths it counts, whatever the others read."""
    for stray, points in ((1, 0), (3, 1)):
        echoes = SonarEchoes((Ranger(0.2, 0.0, 0.0),))
        readings = [none] * 2 + [1.0] * stray + [math.inf] * (3 - stray)
        for k, reading in enumerate(readings):
            found = echoes.points(Senses(RobotState(time=0.1 * k, sonar=np.array([reading])), None, 0.1 * k))
        assert len(found) == points
