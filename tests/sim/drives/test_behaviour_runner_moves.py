"""Turning, going to set points and stopping, by truth; and how behaviours fail."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Signals, Twist
from refseq_bench.robots.behaviours import BehaviourOutcome, BehaviourStep
from refseq_bench.robots.behaviours.guarded import PATIENCE
from refseq_bench.robots.behaviours.written import KINDS, BehaviourKind, make_behaviour, parse_behaviour
from refseq_bench.robots.segway_rmp import MOUNTING
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.drives.behaviour_runner import description_of, run, running
from refseq_bench.worlds.build import World
from tests.sim.drives.behaving_in import BOX, PERFECT, Behaved, behaved, corridor
from tests.sim.machines import ROBOTS, mostly

SLIP = {"robuter": 0.003, "segway_rmp": 0.0}


@pytest.fixture(scope="module")
def room() -> World:
    return corridor(12)


@pytest.mark.quick_cases("robuter--180")
@pytest.mark.parametrize("angle", [-180, 270])
@pytest.mark.parametrize("robot", ROBOTS)
def test_it_turns_by_the_angle_and_stays_in_its_place(room: World, robot: str, angle: int) -> None:
    done = behaved(room, robot, f"MT:{angle}", (5.0, 0.0, 0.2))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    turned = np.unwrap(done.ended.path[:, 2])
    over = math.degrees(np.abs(turned - turned[0]).max()) - abs(angle)
    rest = math.remainder(done.rest.heading - 0.2 - math.radians(angle), 2 * math.pi)
    # Half a degree where the odometer ends it, and what the wheels slip (the Robuter's README: 0.3 %).
    assert abs(math.degrees(rest)) < 0.5 + SLIP[robot] * abs(angle)
    assert over < 0.8
    # It has not ended before it rests.
    assert abs(math.degrees(math.remainder(done.rest.heading - turned[-1], 2 * math.pi))) < 0.2
    assert math.dist((done.rest.x, done.rest.y), (5.0, 0.0)) < 0.03


@pytest.mark.quick_cases("robuter")
@pytest.mark.parametrize("robot", ROBOTS)
def test_it_turns_on_an_arc_whose_end_is_known(room: World, robot: str) -> None:
    done = behaved(room, robot, "MT:60,0.8", (4.0, -0.2, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    angle, radius = math.radians(60), 0.8
    end = 4.0 + radius * math.sin(angle), -0.2 + radius * (1 - math.cos(angle))
    assert (done.rest.x, done.rest.y) == pytest.approx(end, abs=0.15)  # it gets going while it turns
    assert abs(math.degrees(done.rest.heading - angle)) < 2
    assert not done.touched


@pytest.mark.quick_cases("robuter")
@pytest.mark.parametrize("robot", ROBOTS)
def test_it_carries_on_along_a_way_beside_it(room: World, robot: str) -> None:
    done = behaved(room, robot, "MN:5,0,0,0.3,-4", (2.0, 0.2, 0.1))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    heading = 0.1 - math.radians(4)
    # The way goes through a point 0.3 m to the left of where the robot looks.
    x, y = done.rest.x - (2.0 - 0.3 * math.sin(0.1)), done.rest.y - (0.2 + 0.3 * math.cos(0.1))
    assert y * math.cos(heading) - x * math.sin(heading) == pytest.approx(0.0, abs=0.05)
    assert done.rest.heading == pytest.approx(heading, abs=math.radians(2))
    assert not done.touched


@pytest.mark.quick_cases("3-0.5-90-robuter")
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(("x", "y", "heading"), [(3, 0.5, 90), (-1.5, -0.3, None)])
def test_it_goes_to_a_set_point(room: World, robot: str, x: float, y: float, heading: float | None) -> None:
    text = f"MA:{x},{y}" + ("" if heading is None else f",{heading}")
    done = behaved(room, robot, text, (5.0, 0.0, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert (done.rest.x, done.rest.y) == pytest.approx((5.0 + x, y), abs=0.04)
    if heading is not None:
        assert abs(math.degrees(math.remainder(done.rest.heading - math.radians(heading), 2 * math.pi))) < 1.5
    assert not done.touched


@mostly("segway_rmp")
def test_a_set_point_behind_a_box_is_given_up_before_the_box(robot: str) -> None:
    done = behaved(corridor(12, BOX.format(x=6, y=0)), robot, "MA:6,0")
    assert done.ended.outcome is BehaviourOutcome.FAILED
    # It stops by itself. Only the watch of the RMP, which reckons with its swaying, comes first for a moment.
    assert done.ended.why.startswith(f"waited {PATIENCE:g} s: way blocked 0.3")
    assert {why.split()[0] for why in done.waited} <= {"way", "laser:" if robot == "segway_rmp" else "way"}
    assert not done.touched
    front = done.rest.x + robots.load(robot).shape.ahead
    assert 5.1 < front < 5.65


@mostly("robuter")
def test_it_waits_for_somebody_who_leaves_the_way_and_then_goes_on(robot: str) -> None:
    walker = '[[person]]\nname = "p"\nat = [6, 0.1]\nwalk = [[6, 0.9]]\nspeed = 0.06\n'
    # Beside the box there is no room to pass until the person has gone aside.
    done = behaved(corridor(12, walker + BOX.format(x=6, y=-0.75)), robot, "MA:7,0")
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert not done.touched
    assert done.rest.x == pytest.approx(9.0, abs=0.05)
    assert time_before_the_person(done) > time_before_the_person(behaved(corridor(12), robot, "MA:7,0")) + 2.0


def time_before_the_person(done: Behaved) -> float:
    """Seconds on the 2 m before the place where somebody stands."""
    x = done.ended.path[:, 0]
    return CONTROL_PERIOD * np.count_nonzero((x > 3.6) & (x < 5.6))


def test_the_tail_of_a_robuter_finds_no_room_at_a_wall_that_it_has_seen(room: World) -> None:
    with Bench(room, robots.load("robuter"), settings=PERFECT) as bench:
        bench.place(Pose(3.0, -0.65, 0.0))
        frame = description_of(bench.robot)
        assert run(bench, make_behaviour(parse_behaviour("MA:1.5,0"), frame)).outcome is BehaviourOutcome.FINISHED
        ended = run(bench, make_behaviour(parse_behaviour("MT:90"), frame))
    assert ended.outcome is BehaviourOutcome.FAILED
    assert ended.why.startswith(f"waited {PATIENCE:g} s: no room to turn by 90°: something 0.")
    assert ended.path[:, 1] == pytest.approx(-0.65, abs=0.03)


def test_an_emergency_stop_fails_a_behaviour_at_once(room: World) -> None:
    with Bench(room, robots.load("robuter"), settings=PERFECT) as bench:
        told: list[BehaviourStep] = []
        for moment in running(bench, make_behaviour(parse_behaviour("MA:5,0"), description_of(bench.robot))):
            told.append(moment.step)
            if len(told) == 50:
                bench.control.emergency_stop()
    assert told[-1].outcome is BehaviourOutcome.FAILED
    assert told[-1].why.startswith("emergency stop")
    assert len(told) < 60


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_sensor_that_reads_no_number_ends_in_a_failure_and_no_exception(room: World, robot: str) -> None:
    def blind(signals: Signals) -> Signals:
        return replace(signals, inertial=signals.inertial._replace(pitch=math.nan)) if signals.time > 1 else signals

    with Bench(room, robots.load(robot), settings=PERFECT) as bench:
        bench.tamper = blind
        ended = run(bench, make_behaviour(parse_behaviour("MN:5"), description_of(bench.robot)), timeout=20.0)
    assert ended.outcome is BehaviourOutcome.FAILED
    assert "sensor" in ended.why


def test_when_its_time_is_up_a_behaviour_has_failed_and_the_robot_is_told_to_stop(room: World) -> None:
    with Bench(room, robots.load("robuter"), settings=PERFECT) as bench:
        moments = list(
            running(bench, make_behaviour(parse_behaviour("MA:5,0"), description_of(bench.robot)), timeout=2.0)
        )
    assert [moment.time for moment in moments] == pytest.approx(0.04 * np.arange(1, len(moments) + 1))
    assert moments[-1].time == pytest.approx(2.04)
    assert moments[-1].step == BehaviourStep(outcome=BehaviourOutcome.FAILED, why="not done after 2 s")
    assert all(moment.step.outcome is BehaviourOutcome.RUNNING for moment in moments[:-1])


def test_the_path_is_the_true_one_and_each_period_is_told(room: World) -> None:
    with Bench(room, robots.load("robuter"), settings=PERFECT) as bench:
        told = []
        ended = run(bench, make_behaviour(parse_behaviour("MT:20"), description_of(bench.robot)), each=told.append)
        assert ended.path[-1] == pytest.approx((bench.pose.x, bench.pose.y, bench.pose.heading))
    assert len(ended.path) == len(told) + 1
    assert ended.time == pytest.approx(0.04 * len(told))


def test_the_lasers_frame_is_the_one_that_the_rmps_own_watch_uses() -> None:
    assert astuple(description_of(robots.load("segway_rmp")).laser) == pytest.approx(astuple(MOUNTING))


def test_the_frame_has_the_sensors_where_the_model_has_them() -> None:
    robot = robots.load("robuter")
    frame = description_of(robot)
    assert (frame.laser.ahead, frame.laser.height, frame.laser.axle) == pytest.approx((0.25, 0.35, 0.12))
    assert len(frame.sonars) == len(robot.sonars) == 24
    # They look outwards, from within the robot's box.
    for sonar in frame.sonars:
        assert -frame.shape.behind - 0.01 <= sonar.x <= frame.shape.ahead
        assert abs(sonar.y) <= frame.shape.half_width + 0.01
        assert sonar.x * math.cos(sonar.bearing) + sonar.y * math.sin(sonar.bearing) > 0


def test_a_robot_of_ones_own_is_described_as_it_is_also_in_a_world(room: World) -> None:
    own = replace(robots.load("robuter"), name="mine")
    own.spec.site(own.laser).pos[0] += 0.1
    frame, known = description_of(own), description_of(robots.load("robuter"))
    assert frame.laser.ahead == pytest.approx(known.laser.ahead + 0.1)
    assert frame.sonars == known.sonars
    with Bench(room, own, settings=PERFECT) as bench:
        assert description_of(bench.robot) == frame
        assert run(bench, make_behaviour(parse_behaviour("MA:0.3,0"), frame)).outcome is BehaviourOutcome.FINISHED


@pytest.mark.quick_cases("segway_rmp-MA", "robuter-MO")
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.code)
@pytest.mark.parametrize("robot", robots.names())
def test_every_behaviour_of_every_robot_ends_with_a_reason_and_the_robot_at_rest(
    room: World, robot: str, kind: BehaviourKind
) -> None:
    done = behaved(room, robot, kind.example, (2.0, 0.2, 0.05), timeout=40.0)
    assert done.ended.outcome in (BehaviourOutcome.FINISHED, BehaviourOutcome.FAILED)
    assert done.ended.why
    assert not done.touched
    last = Pose(*done.ended.path[-1])
    assert math.dist((done.rest.x, done.rest.y), (last.x, last.y)) < 0.1


def test_standing_still_takes_the_speed_out(room: World) -> None:
    with Bench(room, robots.load("segway_rmp"), settings=PERFECT) as bench:
        for _ in range(75):
            bench.drive(Twist(0.5, 0.0))
        ended = run(bench, make_behaviour(parse_behaviour("stop"), description_of(bench.robot)))
        assert ended.outcome is BehaviourOutcome.FINISHED
        assert 0.2 < ended.time < 5.0
        assert abs(bench.state.twist.linear) < 0.05


def test_with_a_wall_right_before_it_it_turns_on_the_spot_where_it_was_to_drive_an_arc() -> None:
    done = behaved(corridor(8), "robuter", "MT:-90,0.5", (7.36, 0.0, 0.0))
    assert done.ended.outcome is BehaviourOutcome.FINISHED
    assert done.rest.heading == pytest.approx(-math.pi / 2, abs=0.05)
    # All of it: where it drove on half-way round, it ran out of room between a wall and a bin.
    assert (done.rest.x, done.rest.y) == pytest.approx((7.36, 0.0), abs=0.1)
    assert not done.touched
