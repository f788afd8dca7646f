"""What every behaviour does with stops, waiting, and a state or a scan that is no good."""

import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Blocked, Cause, PlanarPose, RobotState, Stop, Twist
from refseq_bench.robots.behaviours import (
    BehaviourOutcome,
    BehaviourStep,
    Guarded,
    RobotDescription,
    Senses,
    finished,
    waiting,
)
from refseq_bench.robots.behaviours.guarded import GOT_ON, PATIENCE, STALE
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.behaviours.written import KINDS, make_behaviour, parse_behaviour
from refseq_bench.robots.state import LATCHED
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

ROBOT = robots.load("robuter")
FRAME = RobotDescription(ROBOT.shape, ROBOT.limits, ON_THE_ROBUTER)
FREE = Scan(np.full(361, np.inf, np.float32))


class Asking(Guarded):
    """Always asks for the same."""

    def __init__(self, step: BehaviourStep) -> None:
        super().__init__(FRAME)
        self.asked = step

    def _move(self, senses: Senses) -> BehaviourStep:
        return self.asked


AHEAD = BehaviourStep(Twist(0.3, 0.1))


def at(time: float, *stops: Stop, **state: object) -> Senses:
    return Senses(RobotState(time=time, stops=stops, **state), FREE, time)


def seconds(behaviour: Guarded, *stops: Stop, limit: float = 30.0) -> tuple[float, BehaviourStep]:
    """When the behaviour ends while the stops hold, and how."""
    for k in range(round(limit / 0.04)):
        step = behaviour.step(at(0.04 * k, *stops))
        if step.outcome is not BehaviourOutcome.RUNNING:
            return 0.04 * k, step
        assert step.twist == Twist()
    raise AssertionError("it never ended")


@pytest.mark.parametrize("cause", sorted(LATCHED, key=lambda cause: cause.value))
def test_a_latched_stop_fails_it_at_once_and_says_why(cause: Cause) -> None:
    step = Asking(AHEAD).step(at(1.0, Stop(cause, "3 of 5", 1.0)))
    assert (step.outcome, step.twist, step.why) == (BehaviourOutcome.FAILED, Twist(), f"{cause.value}: 3 of 5")


@pytest.mark.parametrize("cause", [Cause.BUMPER, Cause.SONAR, Cause.LASER, Cause.NO_ANSWER])
def test_any_other_stop_is_waited_for_and_fails_it_when_patience_ends(cause: Cause) -> None:
    when, step = seconds(Asking(AHEAD), Stop(cause, "0.30 m ahead", 0.0))
    assert when == pytest.approx(PATIENCE, abs=0.05)
    assert step.outcome is BehaviourOutcome.FAILED
    assert step.why == f"waited 10 s: {cause.value}: 0.30 m ahead"


def test_a_stop_that_goes_lets_it_go_on() -> None:
    behaviour = Asking(AHEAD)
    stop = Stop(Cause.SONAR, "", 0.0)
    assert behaviour.step(at(0.0, stop)) == BehaviourStep(why="sonar")
    assert behaviour.step(at(PATIENCE - 0.1, stop)) == BehaviourStep(why="sonar")
    assert behaviour.step(at(PATIENCE + 1.0)) == AHEAD


def test_one_that_starts_and_stops_before_the_same_thing_fails_but_not_one_that_gets_on() -> None:
    for moved, outcome in ((GOT_ON / 2, BehaviourOutcome.FAILED), (GOT_ON * 2, BehaviourOutcome.RUNNING)):
        behaviour, stop = Asking(AHEAD), Stop(Cause.SONAR, "", 0.0)
        behaviour.step(at(0.0, stop))
        behaviour.step(at(PATIENCE / 2, distance=moved))
        assert behaviour.step(at(PATIENCE + 0.1, stop, distance=moved)).outcome is outcome


@pytest.mark.parametrize(
    ("blocks", "twist", "goes"),
    [
        (Blocked.FORWARD, Twist(0.3, 0.0), False),
        (Blocked.FORWARD, Twist(0.0, 0.3), True),
        (Blocked.FORWARD, Twist(-0.3, 0.3), True),
        (Blocked.BACKWARD, Twist(0.3, 0.0), True),
        (Blocked.BACKWARD, Twist(-0.3, 0.0), False),
        (Blocked.ALL, Twist(0.0, 0.3), False),
    ],
)
def test_a_stop_forbids_only_the_motion_that_it_is_about(blocks: Blocked, twist: Twist, goes: bool) -> None:
    step = Asking(BehaviourStep(twist)).step(at(0.0, Stop(Cause.BUMPER, "", 0.0, blocks)))
    assert step.twist == (twist if goes else Twist())


def test_what_is_too_fast_is_slowed_on_the_same_arc() -> None:
    assert Asking(BehaviourStep(Twist(5.0, 1.0))).step(at(0.0)).twist == Twist(0.5, 0.1)


def test_no_news_of_the_robot_is_waited_for_and_fails_it() -> None:
    behaviour = Asking(AHEAD)
    old = RobotState(time=0.0)
    assert behaviour.step(Senses(old, FREE, STALE - 0.1)).twist == AHEAD.twist
    assert behaviour.step(Senses(old, FREE, STALE + 0.1)) == waiting("no news of the robot for 0.6 s")
    assert behaviour.step(Senses(old, FREE, STALE + 0.1 + PATIENCE)).outcome is BehaviourOutcome.FAILED


@pytest.mark.parametrize("where", ["x", "y", "heading"])
def test_an_odometer_without_a_number_is_waited_for(where: str) -> None:
    state = RobotState(pose=replace(PlanarPose(), **{where: math.nan}))
    assert Asking(AHEAD).step(Senses(state, FREE, 0.0)) == waiting("the odometer reads no number")


@pytest.mark.parametrize("lost", [math.nan, math.inf])
def test_one_reading_of_no_number_is_forgotten_once_it_has_got_on(lost: float) -> None:
    behaviour = Asking(AHEAD)
    assert behaviour.step(at(0.0, distance=lost)).outcome is BehaviourOutcome.RUNNING
    for k in range(1, 100):
        assert behaviour.step(at(0.2 * k, distance=0.1 * k)) == AHEAD
    behaviour.asked = waiting("a person")
    assert behaviour.step(at(20.0, distance=10.0)) == waiting("a person")
    assert behaviour.step(at(20.1 + PATIENCE, distance=10.0)).outcome is BehaviourOutcome.FAILED


@pytest.mark.parametrize("lost", [math.nan, math.inf])
@pytest.mark.parametrize("every", [1, 2])
def test_an_odometer_that_reads_no_number_for_long_fails_it(lost: float, every: int) -> None:
    """Also where every second reading is one, and the robot does not get on."""
    behaviour = Asking(waiting("a person"))
    looks = [at(0.1 * k, distance=0.0 if k % every else lost) for k in range(round(PATIENCE / 0.1) + 2)]
    assert [behaviour.step(look).outcome for look in looks][-1] is BehaviourOutcome.FAILED


def test_after_the_end_it_says_stop_with_the_same_reason_whatever_comes() -> None:
    behaviour = Asking(finished("there"))
    assert behaviour.step(at(0.0)) == finished("there")
    behaviour.asked = AHEAD
    assert behaviour.step(at(1.0, Stop(Cause.EMERGENCY, "", 0.0))) == finished("there")


NEEDS_SCAN = [kind for kind in KINDS if kind.code != "stop"]


@pytest.mark.parametrize("kind", NEEDS_SCAN, ids=lambda kind: kind.code)
@pytest.mark.parametrize("ranges", [None, np.full(361, np.nan), np.empty(0)], ids=["none", "no numbers", "no beams"])
def test_without_a_scan_nobody_moves_and_in_the_end_it_fails(kind: object, ranges: np.ndarray | None) -> None:
    scan = None if ranges is None else Scan(ranges.astype(np.float32))
    behaviour = make_behaviour(parse_behaviour(kind.example), FRAME, lambda scan: ())
    for k in range(300):
        step = behaviour.step(Senses(RobotState(time=0.04 * k), scan, 0.04 * k))
        assert step.twist == Twist()
        if step.outcome is not BehaviourOutcome.RUNNING:
            break
    assert step.outcome is BehaviourOutcome.FAILED
    assert step.why.startswith("waited 10 s: ")


def test_a_scan_that_does_not_change_any_more_is_lost_and_back_with_the_next_one() -> None:
    around = Surroundings(FRAME)
    around.look(Senses(RobotState(), FREE, 0.0))
    assert (around.lost, around.fresh) == ("", True)
    around.look(Senses(RobotState(), FREE, 0.9))
    assert (around.lost, around.fresh) == ("", False)
    around.look(Senses(RobotState(), FREE, 1.5))
    assert (around.lost, around.fresh) == ("no new scan for 1.5 s", False)
    around.look(Senses(RobotState(), Scan(FREE.ranges.copy()), 1.6))
    assert (around.lost, around.fresh) == ("", True)


def test_a_pitched_laser_sees_the_floor_and_takes_it_for_no_wall() -> None:
    pitch = math.radians(6)
    bearings = FREE.bearings
    floor = np.where(np.cos(bearings) > 1e-6, 0.35 / (np.maximum(np.cos(bearings), 1e-6) * math.sin(pitch)), np.inf)
    scan = Scan(floor.astype(np.float32))
    for nose_down, met in ((pitch, 0), (0.0, 100)):
        around = Surroundings(FRAME)
        around.look(Senses(RobotState(pitch=nose_down), scan, 0.0))
        assert (len(around.all) > met) == (met > 0)


def test_what_the_laser_has_passed_is_remembered_beside_the_robot_and_not_ahead_of_it() -> None:
    around = Surroundings(FRAME)
    wall = Scan((1.0 / np.maximum(np.sin(np.abs(FREE.bearings)), 1e-3)).astype(np.float32))  # both sides, 1 m away
    around.look(Senses(RobotState(), wall, 0.0))
    around.look(Senses(RobotState(pose=PlanarPose(0.8, 0, 0)), Scan(FREE.ranges.copy()), 0.2))
    seen = around.points(PlanarPose(0.8, 0, 0))
    assert len(seen) > 10
    assert seen[:, 0].max() < FRAME.laser.ahead
    assert np.abs(seen[:, 1]) == pytest.approx(1.0, abs=0.02)
    around.look(Senses(RobotState(pose=PlanarPose(5.0, 0, 0)), Scan(FREE.ranges.copy()), 0.4))
    assert len(around.all) == 0


def test_a_pose_is_carried_on_by_the_velocity_for_a_while() -> None:
    state = RobotState(time=1.0, pose=PlanarPose(1, 2, 0), distance=3.0, twist=Twist(0.5, 0.0))
    assert Senses(state, FREE, 1.1).pose.x == pytest.approx(1.05)
    assert Senses(state, FREE, 1.1).distance == pytest.approx(3.05)
    assert Senses(state, FREE, 9.0).pose.x == pytest.approx(1.15)
    assert Senses(state, FREE, 0.5).pose.x == Senses(state, FREE).pose.x == 1.0
