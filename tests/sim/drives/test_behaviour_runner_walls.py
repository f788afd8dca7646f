"""Wall following and carrying on, by truth."""

import numpy as np
import pytest

from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.worlds.build import World
from tests.sim.drives.behaving_in import BOX, behaved, corridor, off
from tests.sim.machines import ROBOTS, mostly

LENGTH, SHORTER = 34.0, 18.0
SIDES = {"left": 1, "right": -1}


@pytest.fixture(scope="module")
def long() -> World:
    return corridor(LENGTH)


@pytest.fixture(scope="module")
def dead_end() -> World:
    return corridor(12)


def keeps_its_distance(world: World, robot: str, side: str, distance: float, length: float = LENGTH) -> None:
    """From the middle and a little aslant to the wall ahead; the first 4 m are to get there."""
    done = behaved(world, robot, f"MW:{side},{distance}", (2.0, 0.0, 0.1))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert done.ended.why.startswith("a wall across the way")
    away = off(done.ended.path, SIDES[side], distance, (6.0, length - 1.5))
    assert done.rest.x > length - 1.5
    assert np.abs(away).max() < 0.05
    assert not done.touched


# Thirty metres take a minute of simulated time each: two of the twelve are run always, along half of that.
@pytest.mark.quick_cases("segway_rmp-right-0.8")
@pytest.mark.parametrize(("robot", "side", "distance"), [("robuter", "left", 0.5), ("segway_rmp", "right", 0.8)])
def test_it_keeps_its_distance_from_a_wall(robot: str, side: str, distance: float) -> None:
    keeps_its_distance(corridor(SHORTER), robot, side, distance, SHORTER)


@pytest.mark.slow
@pytest.mark.parametrize("distance", [0.5, 0.8, 1.2])
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("robot", ROBOTS)
def test_it_keeps_each_of_three_distances_for_30_m_on_both_sides(
    long: World, robot: str, side: str, distance: float
) -> None:
    keeps_its_distance(long, robot, side, distance)


@mostly("robuter")
def test_in_a_dead_end_it_turns_back_along_the_other_wall(dead_end: World, robot: str) -> None:
    done = behaved(dead_end, robot, "MW:right,0.6,9", (7.0, -0.6, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert not done.touched
    assert abs(done.rest.heading) > 2.9
    assert done.ended.path[:, 0].max() > 10.9
    # The wall that was to the left is to the right now, at the same distance.
    assert done.rest.y == pytest.approx(0.6, abs=0.05)


@mostly("segway_rmp")
def test_it_passes_a_cabinet_and_an_open_door_and_comes_back_to_the_wall(robot: str) -> None:
    things = (
        '[[cabinet]]\nname = "c"\nwall = "right"\nat = 5\n[[door]]\nname = "d"\nwall = "right"\nat = 8.5\nopen = 95'
    )
    done = behaved(corridor(18, things), robot, "MW:right,0.6,10", (2.0, -0.6, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert not done.touched
    near = np.abs(done.ended.path[:, 0] - 5) < 0.4
    assert done.ended.path[near, 1].min() > -1.2 + 0.35 + 0.3
    assert np.abs(off(done.ended.path, -1, 0.6, (10.5, 12.0))).max() < 0.05


def test_it_is_done_where_the_wall_ends() -> None:
    done = behaved(corridor(16, left=7), "robuter", "MW:left,0.8", (2.0, 0.4, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert done.ended.why.startswith("the wall ended after ")
    assert done.rest.x == pytest.approx(7.15, abs=0.05)  # walls go on by their thickness, for corners


def test_without_a_wall_it_fails_and_says_so() -> None:
    done = behaved(corridor(16, left=3), "segway_rmp", "MW:left,0.8", (8.0, 0.0, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FAILED
    assert done.ended.why == "waited 10 s: no wall on the left within 2.5 m"
    assert done.rest.x == pytest.approx(8.0, abs=0.05)


@mostly("robuter")
def test_carrying_on_it_keeps_to_the_middle_and_passes_a_box(robot: str) -> None:
    done = behaved(corridor(14, BOX.format(x=6.5, y=0.1)), robot, "MN:10", (2.0, 0.3, 0.1))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert not done.touched
    path = done.ended.path
    assert np.abs(path[(path[:, 0] > 4.0) & (path[:, 0] < 4.2), 1]).max() < 0.25
    assert path[np.argmin(np.abs(path[:, 0] - 6.5)), 1] < -0.4
    assert path[path[:, 0] > 11.0, 1] == pytest.approx(0.0, abs=0.05)


def test_carrying_on_it_fails_where_nothing_is_free() -> None:
    things = "\n".join(BOX.format(x=6, y=y).replace('"box"', f'"box{k}"', 1) for k, y in enumerate((-0.8, 0.0, 0.8)))
    done = behaved(corridor(14, things), "robuter", "MN:8")
    assert done.ended.outcome is BehaviourOutcome.FAILED
    assert done.ended.why.startswith("waited 10 s: ")
    assert not done.touched


@pytest.mark.quick_cases("1.2,1.2-0.0")
@pytest.mark.parametrize(("told", "middle"), [("1.2,1.2", 0.0), ("0.9,1.5", 0.3)])
def test_told_of_both_walls_it_knows_them_from_anywhere_between_them(told: str, middle: float) -> None:
    done = behaved(corridor(14), "robuter", f"MN:9,{told}", (2.0, -0.65, -0.05))  # more than half a metre aside
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    path = done.ended.path
    assert path[path[:, 0] > 8.0, 1] == pytest.approx(middle, abs=0.05)
    assert not done.touched


@pytest.mark.quick_cases("6.2-BehaviourOutcome.FAILED")
@pytest.mark.parametrize(("length", "outcome"), [(5.7, BehaviourOutcome.FINISHED), (6.2, BehaviourOutcome.FAILED)])
def test_before_a_wall_its_way_is_done_where_little_is_left_of_it(length: float, outcome: BehaviourOutcome) -> None:
    done = behaved(corridor(8), "robuter", f"MN:{length:g}")
    assert done.ended.outcome is outcome
    assert "waited 10 s: way blocked" in done.ended.why
    assert done.rest.x == pytest.approx(8 - 0.335 - 0.3, abs=0.1)
    assert not done.touched
