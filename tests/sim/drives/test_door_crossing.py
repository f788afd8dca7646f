"""Robots go through doors, or say why not: by the truth of where they end, what they touch and how near they come."""

import math
import re
from collections.abc import Sequence

import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.robots.behaviours.cross_door import CrossingSide
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.sim.doorways import CORNERS, THICK, Crossing, Doorkeeper, cross, from_behind, rooms, standing, starts
from tests.sim.machines import ROBOTS, mostly

every_robot = pytest.mark.parametrize("name", ROBOTS)
ENOUGH = 0.05
"""Least distance [m] to what stands there: a door of 0.9 m leaves the Robuter 9.5 cm on either side."""
ANA = """
[[person]]
name = "ana"
at = [-1.0, 0.0]
"""
INTO_ITS_WAY = """
[[person]]
name = "ana"
at = [3.3, 0.7]
walk = [[0.95, 0.7], [0.95, 0.0], [3.3, 0.0]]
speed = 0.22
"""


def through(crossing: Crossing, name: str) -> bool:
    """Whether the robot and the truth agree that it is through: its tail is behind the wall, and it touched nothing."""
    return crossing.good and crossing.end.x - robots.load(name).shape.behind > THICK


@pytest.mark.quick_cases("other-hinge-robuter")
@every_robot
@pytest.mark.parametrize(
    ("door", "corners"),
    [("open = 90", CORNERS[:2]), ('open = 95\nhinge = "end"', CORNERS[2:])],
    ids=["square", "other-hinge"],
)
def test_it_crosses_a_door_without_touching_it(name: str, door: str, corners: Sequence[Pose]) -> None:
    with standing(rooms(door), name) as bench:
        for start in corners:
            crossing = cross(bench, start)
            assert through(crossing, name), crossing
            assert crossing.clearance > ENOUGH


@mostly("segway_rmp", "name")
def test_a_side_wall_does_not_keep_it_from_crossing(name: str) -> None:
    """The wall is 15 cm from the jamb, so the robot starts on the other side of it."""
    with standing(rooms("open = 100", side=0.6), name) as bench:
        crossing = cross(bench, Pose(-1.8, 0.35, math.radians(-10)))
        assert through(crossing, name), crossing


@mostly("robuter", "name")
def test_it_comes_out_of_a_room_into_which_the_door_opens(name: str) -> None:
    """The room is 2.1 m wide and the leaf 0.9 m long: it has to turn before the leaf's tip."""
    with standing(rooms("open = 90"), name) as bench:
        crossing = cross(bench, from_behind(Pose(-1.76, -0.27, math.radians(-14))))
        assert crossing.good, crossing
        assert crossing.end.x < -robots.load(name).shape.behind


REFUSED = {
    "closed": ("open = 0", r"door 0\.0\d m open of 0\.\d\d m: closed"),
    "half-open": ("open = 45", r"door 0\.2\d m open of 0\.\d\d m: half open"),
    "two-thirds-open": ('open = 65\nhinge = "end"', r"door 0\.5\d m open of 0\.\d\d m: half open"),
    "narrow": ("width = 0.7\nopen = 100", r"door 0\.\d\d m wide: too narrow, 0\.\d\d m are needed"),
}


@pytest.mark.quick_cases("closed-robuter", "half-open-segway_rmp", "two-thirds-open-robuter", "narrow-segway_rmp")
@every_robot
@pytest.mark.parametrize(("door", "why"), REFUSED.values(), ids=REFUSED)
def test_it_refuses_what_it_does_not_fit_through(name: str, door: str, why: str) -> None:
    with standing(rooms(door), name) as bench:
        for start in starts(np.random.default_rng(6), 3):
            crossing = cross(bench, start)
            assert crossing.outcome is BehaviourOutcome.FAILED
            assert re.fullmatch(why, crossing.why), crossing.why
            assert math.hypot(crossing.end.x - start.x, crossing.end.y - start.y) < 0.1


@mostly("segway_rmp", "name")
def test_it_waits_for_somebody_behind_the_door_and_then_gives_up(name: str) -> None:
    with standing(moved(rooms("open = 100", end=ANA), "person:ana", 1.8), name) as bench:
        crossing = cross(bench, Pose(-1.7, 0.2, 0.1), patience=3.0)
        assert crossing.outcome is BehaviourOutcome.FAILED
        assert re.match(r"waited 3 s: something stands in the door: 0\.\d\d m free of", crossing.why), crossing.why
        assert crossing.end.x < 0
        assert not crossing.touched


@pytest.mark.quick_cases("robuter")
@every_robot
def test_it_does_not_go_where_somebody_stands_between_the_jambs(name: str) -> None:
    """Legs in the plane of the wall look like two gaps that end at no wall: then no door is found."""
    with standing(moved(rooms("open = 100", end=ANA), "person:ana", 1.1), name) as bench:
        crossing = cross(bench, Pose(-1.7, 0.2, 0.1), patience=3.0)
        assert crossing.outcome is BehaviourOutcome.FAILED
        seen = r"no door ahead; something 1\.\d m in front|something stands in the door"
        assert re.match(f"waited 3 s: ({seen})", crossing.why), crossing.why
        assert not crossing.touched


@mostly("robuter", "name")
def test_it_waits_for_somebody_who_walks_into_its_way_while_it_crosses(name: str) -> None:
    """Ana comes along the side of the room behind, steps before the robot when it is in the door, and walks away."""
    with standing(rooms("open = 100", end=INTO_ITS_WAY), name) as bench:
        crossing = cross(bench, Pose(-1.7, 0.2, 0.1))
        assert through(crossing, name), crossing
        assert any(re.match(r"(something is|sonar:) 0\.\d\d m ahead", why) for why in crossing.waited), crossing


@pytest.mark.quick_cases("0.3--0.2-robuter")
@every_robot
@pytest.mark.parametrize(("back", "aside"), [(0.0, 0.12), (0.3, -0.2)])
def test_it_stops_where_it_was_carried_off_while_it_crosses(name: str, back: float, aside: float) -> None:
    """The odometer does not notice, as when all wheels slip; the door that is elsewhere tells."""
    with standing(rooms("open = 100"), name) as bench:
        carried: list[Pose] = []

        def carry() -> None:
            x, y, heading = bench.pose.x, bench.pose.y, bench.pose.heading
            if not carried and bench.state.twist.linear > 0.15 and x > -0.6:
                carried.append(Pose(x - back, y + aside, heading))
                bench.place(carried[0])

        crossing = cross(bench, Pose(-1.7, 0.0, 0.0), meanwhile=carry)
        assert carried
        assert crossing.outcome is BehaviourOutcome.FAILED
        why = re.fullmatch(r"the door is (0\.\d\d) m from where it was: .*", crossing.why)
        assert why, crossing.why
        assert float(why[1]) == pytest.approx(math.hypot(back, aside), abs=0.06)
        assert crossing.end.x - carried[0].x < 0.3
        assert not crossing.touched


def moved(world: World, prefix: str, ahead: float) -> World:
    """The world with all geoms of a name moved along x [m]: a plan lets nobody stand in a doorway."""
    for geom in world.spec.geoms:
        if geom.name.startswith(prefix):
            geom.pos = geom.pos + np.array([ahead, 0.0, 0.0])
    return world


def test_it_finds_no_door_in_a_wall() -> None:
    with standing(rooms(None), "robuter") as bench:
        crossing = cross(bench, Pose(-1.7, 0.2, 0.1), patience=3.0)
        assert crossing.outcome is BehaviourOutcome.FAILED
        assert crossing.why == "waited 3 s: no door ahead; something 1.3 m in front"


def test_the_doorkeeper_sees_a_touch() -> None:
    """A robot that drives past the middle hits the jamb: the checks above could fail."""
    with standing(rooms(), "robuter") as bench:
        bench.place(Pose(-0.5, 0.2, 0.0))
        keeper = Doorkeeper(bench)
        for _ in range(100):
            bench.drive(Twist(0.2))
            keeper.look()
        assert keeper.touched <= {"wall:front:0", "wall:front:2", "wall:front:1"}
        assert keeper.touched
        assert keeper.clearance < 0.001


# --- in worlds of the library, whose doors have furniture and people's things around them ---


def opened(world: str, door: str) -> World:
    """A world of the library with one door open."""
    plan = load_plan(world)
    doors = [one.model_copy(update={"open": 95.0}) if one.name == door else one for one in plan.door]
    return build_world(plan.model_copy(update={"door": tuple(doors)}), light_named("16:00"), pictured=False)


@pytest.fixture(scope="module")
def laboratory() -> World:
    return opened("laboratory", "store")


@pytest.mark.slow
@mostly("segway_rmp", "name")
def test_it_crosses_a_door_of_the_laboratory_between_poster_and_bin(laboratory: World, name: str) -> None:
    with standing(laboratory, name) as bench:
        crossing = cross(bench, Pose(1.5, 7.8, math.radians(110)))
        assert crossing.good, crossing
        assert crossing.end.y - robots.load(name).shape.behind > 9.6 + THICK


@pytest.mark.slow
@every_robot
def test_it_turns_from_a_corridor_into_a_room(name: str) -> None:
    """To the right and to the left of a corridor of 2.2 m; the second floor takes 20 s to build."""
    with standing(opened("second-floor", "north-labs-east-4"), name) as bench:
        for start, side in (
            (Pose(43.5, 24.1, 0.0), CrossingSide.RIGHT),
            (Pose(47.8, 24.2, math.pi), CrossingSide.LEFT),
        ):
            crossing = cross(bench, start, side)
            assert crossing.good, crossing
            assert crossing.end.y + robots.load(name).shape.behind < 23.0 - THICK


# --- many starts ---


@pytest.mark.slow
@every_robot
def test_it_crosses_from_19_of_20_random_starts_and_never_touches(name: str) -> None:
    """200 starts, of which 95 % are to lead through; none may touch anything."""
    with standing(rooms("open = 95"), name) as bench:
        crossings = [cross(bench, start) for start in starts(np.random.default_rng(1), 200)]
    assert not [crossing for crossing in crossings if crossing.touched]
    assert sum(through(crossing, name) for crossing in crossings) >= 190


@pytest.mark.slow
@every_robot
@pytest.mark.parametrize("angle", [0, 20, 40, 60])
def test_it_refuses_from_every_start(name: str, angle: int) -> None:
    with standing(rooms(f"open = {angle}"), name) as bench:
        crossings = [cross(bench, start) for start in starts(np.random.default_rng(2), 50)]
    assert all(crossing.outcome is BehaviourOutcome.FAILED for crossing in crossings)
    assert all(re.search("closed$|half open$", crossing.why) for crossing in crossings)
