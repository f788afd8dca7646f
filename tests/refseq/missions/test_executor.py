"""The executor against scripted beliefs with every kind of error: what is run, where, and what is said of it."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.belief import Belief, pose_beside
from refseq.missions.executor import Executor, ExecutorSettings, Status
from refseq.missions.log import Level, Touch
from refseq.missions.path import MissionPath
from refseq.missions.plan import Order, Plan, as_learnt
from refseq.missions.tasks import Call, Photograph, Wait
from tests.refseq.missions.on_a_line import SPEED, STEP, Line, Script, flat, lost, right, seen_at, way

TOLD = {0: "MN:12", 12: "MT:90", 13: "MW:left,0.8,18"}
"""Straight on for 12 m, a turn, and along a wall to 30 m."""
WAY = way(30.0, told=TOLD)
COUNT = len(WAY.along)
DONE = ["MN", "MT", "MW"]
some = settings(max_examples=25, derandomize=True)


def learnt(of: MissionPath = WAY, **more: object) -> Executor:
    return Executor(as_learnt(of), **more)  # type: ignore[arg-type]


def with_tasks() -> Plan:
    orders = (
        Order(0.0, "MN", "start"),
        Order(10.0, "MN", "the picture", (Photograph("p"), Wait(5.0), Call("c"))),
        Order(20.0, "MT:90", "the corner"),
        Order(20.0, "MN", "as learnt"),
    )
    return Plan(way(30.0), orders, 30.0, (Call("home"), Photograph("end")))


def wrong_now_and_then(share: float, seed: int) -> Script:
    """Right beliefs, but for some that are elsewhere, lost or flat: never two in a row."""
    rng, before = np.random.default_rng(seed), [False]

    def script(number: int, x: float) -> Belief:
        before[0] = bool(rng.random() < share) and not before[0]
        if not before[0]:
            return seen_at(WAY.along, x + rng.normal(0, 0.2))
        kind = rng.integers(3)
        return (seen_at(WAY.along, rng.uniform(0, 30)), lost(COUNT), flat(COUNT))[kind]

    return script


def seen_beside(of: MissionPath, beside: float) -> Script:
    """Right beliefs, but for so many metres."""
    return lambda number, x: seen_at(of.along, x + beside)


def turned_at(line: Line) -> list[float]:
    return [one.x for one in line.begun if one.words.startswith("MT")]


def told(line: Line) -> str:
    return "\n".join(map(str, line.executor.log))


def check_log(line: Line) -> None:
    """Time never goes back, and a behaviour's number rises by one with each that is begun."""
    log, begun = line.executor.log, line.begun
    assert all(one.time <= after.time for one, after in pairwise(log))
    assert all(one[1] <= after[1] for one, after in pairwise(line.executor.switches))
    assert all(after.number > one.number for one, after in pairwise(begun))
    assert line.executor.do.halt == line.executor.status.over


# --- beliefs that are right, or wrong now and then ---


@pytest.mark.parametrize("localised", [True, False])
def test_a_mission_is_run_as_it_was_learnt(localised: bool) -> None:
    line = Line(learnt(localised=localised), right(WAY) if localised else None).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == DONE
    assert turned_at(line) == [pytest.approx(12.0, abs=0.2)]
    assert line.x == pytest.approx(30.0, abs=0.2)
    assert [number for number, _ in line.executor.switches] == [0, 1, 2]
    check_log(line)


@some
@given(st.integers(0, 10**6))
def test_one_view_in_five_may_be_wrong(seed: int) -> None:
    line = Line(learnt(), wrong_now_and_then(0.2, seed)).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == DONE
    assert turned_at(line) == [pytest.approx(12.0, abs=0.8)]
    assert line.x == pytest.approx(30.0, abs=0.8)
    check_log(line)


@some
@given(at=st.integers(0, 28), to=st.floats(0.0, 30.0), kind=st.sampled_from(["elsewhere", "lost", "flat"]))
def test_no_order_fires_from_a_single_wrong_view(at: int, to: float, kind: str) -> None:
    """The same orders begin where they do without it, but for what a view may put right at once."""

    def script(number: int, x: float) -> Belief:
        if number != at:
            return seen_at(WAY.along, x)
        return {"elsewhere": seen_at(WAY.along, to), "lost": lost(COUNT), "flat": flat(COUNT)}[kind]

    line = Line(learnt(), script).run()
    assert line.words == DONE, told(line)
    assert turned_at(line) == [pytest.approx(12.0, abs=0.8)]
    assert line.x == pytest.approx(30.0, abs=0.8)
    assert line.executor.status is Status.COMPLETED


def test_what_is_not_believed_is_told() -> None:
    line = Line(learnt(), lambda number, x: lost(COUNT) if number == 5 else seen_at(WAY.along, x)).run()
    assert "a view says lost; not believed yet" in told(line)
    line = Line(learnt(), lambda number, x: seen_at(WAY.along, 25.0 if number == 5 else x)).run()
    assert "a view says elsewhere; not believed yet" in told(line)


def test_just_before_its_start_it_is_at_zero_metres() -> None:
    executor = learnt()
    executor.move(0.0, -0.04)
    executor.believe(seen_at(WAY.along, 0.0, width=0.1))
    assert executor.along < 0
    assert "knows where it is: at 0.0 m" in str(executor.log[1])
    assert "-0.0 m" not in "".join(map(str, executor.log))


# --- a robot that is not where its odometer says ---


@pytest.mark.parametrize("at", [3.0, 8.0, 16.0])
def test_wheels_that_slip_for_two_metres(at: float) -> None:
    line = Line(learnt(), right(WAY))

    def slip(now: Line) -> None:
        now.grip = 0.0 if at <= now.travelled < at + 2.0 else 1.0

    line.run(each=slip)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == DONE
    assert turned_at(line) == [pytest.approx(12.0, abs=0.5)]
    assert line.x == pytest.approx(30.0, abs=0.5)


def test_an_odometer_that_is_wrong_by_a_twentieth() -> None:
    for grip in (0.95, 1.05):
        line = Line(learnt(), right(WAY), grip=grip).run()
        assert line.executor.status is Status.COMPLETED, told(line)
        assert line.x == pytest.approx(30.0, abs=0.5)
        blind = Line(learnt(localised=False), None, grip=grip).run()
        assert abs(blind.x - 30.0) > 1.0, "the odometer alone cannot know"


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (10.0, "2.0 m ahead of where it was believed to be"),  # it is stuck, and the odometer runs on
        (11.0, ""),
        (13.0, ""),
        (14.0, "2.0 m behind where it was believed to be"),
    ],
)
def test_where_the_odometer_ends_an_order_far_from_the_views_the_log_says_so(seen: float, words: str) -> None:
    executor = learnt()
    executor.believe(seen_at(WAY.along, 0.0))
    executor.move(21.0, 10.6)
    assert executor.status is Status.APPROACHING
    for along in [*np.linspace(10.6, seen, 40), *[seen] * 40]:  # no view is far from the one before
        executor.believe(seen_at(WAY.along, float(along), width=0.2))
    assert executor.along == pytest.approx(seen, abs=0.05)
    executor.ended(True, "went on for 1.40 m")
    jumps = [line for line in executor.log if "believed to be" in line.what]
    assert [(line.what, line.level) for line in jumps] == [(f"goes on from 12.0 m, {words}", Level.WARN)] * bool(words)
    assert all(line.along == pytest.approx(seen, abs=0.05) for line in jumps)
    assert executor.along == 12.0


def test_a_touch_is_told_at_its_time_also_behind_the_end() -> None:
    executor = learnt()
    executor.move(3.0, 1.5)
    executor.touched(Touch(3.04, "table:trolley:0"))
    executor.abort()
    executor.touched(Touch(3.2, "wall:n1:0"))
    assert [str(line) for line in executor.log if line.what.startswith("touches")] == [
        "    3.0 s     1.5 m  touches table:trolley:0",
        "    3.2 s     1.5 m  touches wall:n1:0",
    ]
    assert executor.log[-1].level is Level.WARN


def carried(line: Line, when: float, to: float) -> Line:
    """Run with the robot carried to a place once it has come so far."""
    went: list[float] = []

    def each(now: Line) -> None:
        if not went and now.x >= when:
            went.append(now.x)
            now.x = to

    return line.run(each=each)


def test_carried_forth_the_orders_between_are_left_out() -> None:
    line = carried(Line(learnt(), right(WAY)), 5.0, 20.0)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == ["MN", "MW"]
    assert "3 views agree that it is elsewhere" in told(line)
    assert line.x == pytest.approx(30.0, abs=0.5)


def test_carried_back_the_orders_are_run_again() -> None:
    line = carried(Line(learnt(), right(WAY)), 20.0, 4.0)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == ["MN", "MT", "MW", "MN", "MT", "MW"]
    assert turned_at(line) == [pytest.approx(12.0, abs=0.5)] * 2
    assert line.x == pytest.approx(30.0, abs=0.5)


def test_a_start_elsewhere_is_found_before_it_goes() -> None:
    line = Line(learnt(), right(WAY), x=20.0).run()
    assert line.words == ["MW"]
    assert line.begun[0].x == 20.0
    assert line.x == pytest.approx(30.0, abs=0.5)


def test_a_mission_that_begins_with_a_turn_turns() -> None:
    """The turn and what follows it begin at the same place, and the first view is a little beside it."""
    for told_at_start in ({0: "MT:90", 1: "MN:9"}, {0: "MT:90", 1: "MT:90", 2: "MN:8"}):
        for beside in (0.0, 0.3):
            of = way(10.0, told=told_at_start)
            line = Line(learnt(of), seen_beside(of, beside)).run()
            assert line.executor.status is Status.COMPLETED, told(line)
            assert [one.words[:2] for one in line.begun][: len(told_at_start)] == [
                words[:2] for words in told_at_start.values()
            ]
    line = Line(learnt(of, localised=False), None).run()
    assert line.words == ["MT", "MN"]


# --- beside the way ---

LEG = way(30.0, told={0: "MN:30,1.2,0"})


def with_pose(of: MissionPath, aside: float, heading: float) -> Script:
    """Right beliefs whose poses tell to the centimetre where beside the nearest place the robot is."""

    def script(number: int, x: float) -> Belief:
        belief = seen_at(of.along, x)
        pose = pose_beside((x - float(of.along[belief.best]), aside, heading), np.eye(3) * 1e-4)
        return replace(belief, pose=pose)

    return script


def test_a_led_leg_is_steered_back_onto_its_way() -> None:
    shown: list[str] = []
    line = Line(learnt(LEG), with_pose(LEG, 0.25, math.radians(-3)))
    line.run(each=lambda line: shown.append(line.executor.doing))
    assert line.executor.status is Status.COMPLETED, told(line)
    steered = [one.words for one in line.begun if one.words.endswith(",1.2,0,-0.25,3.0")]
    assert len(steered) > 20  # at each view on the way
    assert len(line.executor.log) < 8  # of which the log is spared, and whoever shows the behaviour
    assert not any(words.count(",") > 2 for words in shown)


def test_what_finds_its_way_by_itself_is_not_steered() -> None:
    line = Line(learnt(), with_pose(WAY, 0.25, 0.0)).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == DONE
    assert not any("-0.25" in one.words for one in line.begun)


@pytest.mark.parametrize("grip", [0.9, 1.1])
def test_the_last_metres_are_put_right_where_poses_tell_them(grip: float) -> None:
    """The slip since the last view is left, not that of the last metre and a half."""
    line = Line(learnt(LEG), with_pose(LEG, 0.0, 0.0), grip=grip).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.x == pytest.approx(30.0, abs=0.1 + STEP * SPEED)


# --- lost ---


@pytest.mark.parametrize(("place", "where"), [(5, "place 5, at 5.0 m"), (COUNT, f"place {COUNT}, off its way")])
def test_a_lost_mission_tells_where_the_chain_was_last_sure(place: int, where: str) -> None:
    """The way is a part of the map, in which there may be other places."""
    known = replace(lost(COUNT + 1), lost_after=np.eye(COUNT + 1)[place] * 0.6)
    line = Line(learnt(), lambda number, x: seen_at(WAY.along, x) if number < 6 else known).run()
    assert f"3 views in a row do not agree; it stands, last sure at {where}" in told(line)
    assert line.executor.why == "lost for 30 s"


def test_a_twin_of_a_place_of_the_way_is_on_it() -> None:
    known = replace(lost(COUNT + 1), lost_after=np.eye(COUNT + 1)[COUNT] * 0.6)
    closed, along = replace(WAY, twins=np.array([[5, COUNT]])), np.append(WAY.along, 99.0)
    line = Line(learnt(closed), lambda number, x: seen_at(along, x) if number < 6 else known).run()
    assert f"last sure at place {COUNT}, at 5.0 m" in told(line)


def test_lost_for_ever() -> None:
    line = Line(learnt(), lambda number, x: seen_at(WAY.along, x) if number < 6 else lost(COUNT)).run()
    assert line.executor.status is Status.FAILED
    assert line.executor.why == "lost for 30 s"
    assert "3 views in a row do not agree; it stands" in told(line)
    assert line.halted == pytest.approx(30.0, abs=1.5)
    assert line.x < 9.0
    check_log(line)


def test_lost_from_the_start() -> None:
    line = Line(learnt(), lambda number, x: lost(COUNT)).run()
    assert line.executor.status is Status.FAILED
    assert line.executor.why == "localising for 30 s"
    assert line.x == 0.0
    assert not line.begun


@pytest.mark.parametrize("first", [4, 9, 10, 11, 12, 20])
def test_lost_for_a_while(first: int) -> None:
    """Right before the turn, too: it is neither left out nor done twice."""

    def script(number: int, x: float) -> Belief:
        return lost(COUNT) if first <= number < first + 8 else seen_at(WAY.along, x + 0.2)

    line = Line(learnt(), script).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == DONE, told(line)
    assert line.halted >= 2.0
    assert turned_at(line) == [pytest.approx(12.0, abs=0.8)]
    check_log(line)


def test_a_single_view_does_not_end_being_lost() -> None:
    """It takes as many that agree as another position does, one behind the other."""

    def script(number: int, x: float) -> Belief:
        return seen_at(WAY.along, x) if number < 5 or number % 3 else lost(COUNT)

    def lost_first(number: int, x: float) -> Belief:
        return lost(COUNT) if 5 <= number < 9 else script(number, x)

    line = Line(learnt(), lost_first).run()
    assert line.executor.status is Status.FAILED, told(line)
    assert line.executor.why == "lost for 30 s"


def test_carried_into_the_middle_of_a_crossing_it_goes_on_behind_it() -> None:
    """Its door is behind the robot: it cannot be crossed from there."""
    orders = (Order(0.0, "MN", "start"), Order(10.0, "MC", "a door"), Order(16.0, "MN", "behind it"))
    line = carried(Line(Executor(Plan(WAY, orders, 30.0)), right(WAY)), 3.0, 11.5)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.words == ["MN"]
    assert line.x == pytest.approx(30.0, abs=0.5)


def test_a_crossing_that_is_done_ends_where_it_ended_when_it_was_learnt() -> None:
    """The odometer counts 2.5 m, and 4 m were learnt: by the odometer alone the rest is 16 m all the same."""
    orders = (Order(0.0, "MN", "start"), Order(10.0, "MC", "a door"), Order(14.0, "MN", "behind it"))
    line = Line(Executor(Plan(WAY, orders, 30.0), localised=False), None).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.x == pytest.approx(10.0 + 2.5 + 16.0, abs=0.2)


# --- what goes wrong ---


def test_a_behaviour_that_fails_fails_the_mission() -> None:
    line = Line(learnt(), right(WAY), fails="MT").run()
    assert line.executor.status is Status.FAILED
    assert line.executor.why == "MT:90 failed: something is in the way"
    assert str(line.executor.log[-1]).endswith("failed: MT:90 failed: something is in the way")
    assert line.x == pytest.approx(12.0, abs=0.3)


def test_views_that_each_say_something_else_are_no_knowledge() -> None:
    """After six of them in a row it is lost, though none says so."""
    line = Line(
        learnt(),
        lambda number, x: seen_at(WAY.along, x) if number < 3 else seen_at(WAY.along, (x + 11 + 6 * (number % 2)) % 30),
    )
    line.run()
    assert line.executor.status is Status.FAILED
    assert "MT:90" not in line.words
    assert "6 views in a row do not agree; it stands" in told(line)
    assert line.executor.why == "lost for 30 s"
    assert line.x < 12.0


def test_a_place_that_is_not_reached_in_the_way_that_it_may_take_is_missed() -> None:
    executor = learnt()
    executor.believe(seen_at(WAY.along, 0.0))
    executor.move(30.0, 3.0)
    executor.ended(True, "went on for 17.4 m")  # as long as it was told to, and the place is not believed to be near
    assert executor.status is Status.FAILED
    assert "not found: 3.0 m gone" in executor.why


def test_an_order_takes_no_longer_than_it_may() -> None:
    orders = (Order(0.0, "MN", "start", timeout=7.0),)
    line = Line(Executor(Plan(WAY, orders, 30.0)), right(WAY)).run()
    assert line.executor.status is Status.FAILED
    assert "not done after 7 s" in line.executor.why
    assert line.time == pytest.approx(7.0, abs=0.5)


def test_a_landmark_that_is_passed_does_not_cost_time() -> None:
    """Each order has its own time from where it begins: 20 s each are enough for 8 m at half a metre a second."""
    orders = tuple(Order(8.0 * number, "MN", f"landmark {number}", timeout=20.0) for number in range(3))
    line = Line(Executor(Plan(WAY, orders, 24.0)), right(WAY)).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert len(line.begun) == 2, "it does not stop at a landmark where it only goes on"
    assert [number for number, _ in line.executor.switches] == [0, 1, 2]


def test_landmarks_near_the_goal_are_passed_as_well() -> None:
    orders = (Order(0.0, "MN", "start"), Order(9.3, "MN", "a door"))
    line = Line(Executor(Plan(WAY, orders, 10.0)), right(WAY)).run()
    assert [number for number, _ in line.executor.switches] == [0, 1]
    assert "passes a door" in told(line)


# --- tasks ---


def test_tasks_are_done_once_where_they_belong() -> None:
    plan = with_tasks()
    line = Line(Executor(plan), right(plan.path)).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert [str(task) for task, _ in line.tasks] == ["photograph 'p'", "call 'c'", "call 'home'", "photograph 'end'"]
    assert [x for _, x in line.tasks] == pytest.approx([10, 10, 30, 30], abs=0.2)
    assert line.halted == pytest.approx(5.0, abs=0.3)
    assert [str(entry) for entry in line.executor.log if "done: " in str(entry)] != []


@pytest.mark.parametrize(("when", "to"), [(13.0, 15.0), (5.0, 14.0), (16.0, 4.0), (13.0, 11.7)])
def test_tasks_are_not_done_elsewhere_or_again(when: float, to: float) -> None:
    """Wherever it is carried, a photograph of the place at 10 m is one from there, and there is one at most."""
    plan = with_tasks()
    line = carried(Line(Executor(plan), right(plan.path)), when, to)
    assert line.executor.status is Status.COMPLETED, told(line)
    photographs = [x for task, x in line.tasks if task == Photograph("p")]
    assert photographs == ([pytest.approx(10.0, abs=0.3)] if when > 10.0 else [])
    if not photographs:
        assert "left out" in told(line)


def test_every_task_that_is_left_out_is_named_once() -> None:
    """Past three pictures to 19 m; the goal is reached and the last one is all that was done."""
    orders = [Order(0.0, "MN", "start")]
    orders += [
        Order(at, "MN", name, (Photograph(name),)) for at, name in ((6.0, "a"), (12.0, "b"), (17.0, "c"), (25.0, "d"))
    ]
    plan = Plan(way(30.0), tuple(orders), 30.0)
    line = carried(Line(Executor(plan), right(plan.path)), 4.0, 19.5)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert [task for task, _ in line.tasks] == [Photograph("d")]
    left = [entry.what for entry in line.executor.log if "left out" in entry.what]
    assert left == ["left out, behind it: photograph 'a', photograph 'b', photograph 'c'"]


def test_tasks_before_the_start_are_named() -> None:
    line = Line(Executor(with_tasks(), localised=False, start=15.0), None, x=15.0).run()
    assert line.executor.status is Status.COMPLETED, told(line)
    assert "left out, behind it: photograph 'p', wait 5 s, call 'c'" in told(line)


def test_lost_behind_a_place_its_tasks_are_not_done_again() -> None:
    plan = with_tasks()
    count = len(plan.path.along)
    line = Line(
        Executor(plan), lambda number, x: lost(count) if 19 <= number < 25 else seen_at(plan.path.along, x)
    ).run()
    assert "lost" in told(line)
    assert [str(task) for task, _ in line.tasks] == ["photograph 'p'", "call 'c'", "call 'home'", "photograph 'end'"]


# --- pause, resume, abort ---


@some
@given(st.lists(st.tuples(st.floats(0.0, 60.0), st.floats(0.1, 200.0)), max_size=4), st.booleans())
def test_pauses_do_not_change_what_is_run(pauses: list[tuple[float, float]], tasks: bool) -> None:
    plan = with_tasks() if tasks else as_learnt(WAY)
    plain = Line(Executor(plan), right(plan.path)).run()
    starts, ends = [at for at, _ in pauses], [at + lasts for at, lasts in pauses]

    def each(now: Line) -> None:
        paused = any(start <= now.time < end for start, end in zip(starts, ends, strict=True))
        if paused:
            now.executor.pause()
        else:
            now.executor.resume()

    line = Line(Executor(plan), right(plan.path)).run(limit=5000.0, each=each)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert [number for number, _ in line.executor.switches] == [number for number, _ in plain.executor.switches]
    assert [task for task, _ in line.tasks] == [task for task, _ in plain.tasks]
    assert line.x == pytest.approx(plain.x, abs=0.2)
    check_log(line)


def test_pauses_longer_than_an_order_may_last() -> None:
    plan = Plan(WAY, (Order(0.0, "MN", "start", timeout=40.0),), 10.0)

    def each(now: Line) -> None:
        if 5.0 < now.time < 100.0:
            now.executor.pause()
        else:
            now.executor.resume()

    line = Line(Executor(plan), right(WAY)).run(each=each)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert len(line.begun) == 2, "it goes on with the execution that was halted"


def test_a_pause_longer_than_a_mission_may_last_counts_for_nothing() -> None:
    made = Executor(Plan(WAY, (Order(0.0, "MN", "start"),), 10.0), settings=ExecutorSettings(timeout=40.0))

    def each(now: Line) -> None:
        if 5.0 < now.time < 100.0:
            now.executor.pause()
        else:
            now.executor.resume()

    line = Line(made, right(WAY)).run(each=each)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert line.time > 100.0


def test_a_mission_that_lasts_too_long_without_pauses_is_aborted() -> None:
    made = Executor(Plan(WAY, (Order(0.0, "MN", "start"),), 30.0), settings=ExecutorSettings(timeout=12.0))
    line = Line(made, right(WAY)).run(
        each=lambda now: now.executor.pause() if now.time < 5.0 else now.executor.resume()
    )
    assert line.executor.status is Status.ABORTED, told(line)
    assert line.executor.why == "not over after 12 s"
    assert line.time == pytest.approx(17.0, abs=0.5)


def test_a_wait_lasts_as_long_as_asked_whatever_pauses_there_are() -> None:
    plan = Plan(WAY, (Order(0.0, "MN", "start", (Wait(10.0),)),), 5.0)

    def each(now: Line) -> None:
        if 4.0 < now.time <= 24.0:
            now.executor.pause()
        else:
            now.executor.resume()

    line = Line(Executor(plan), right(WAY)).run(each=each)
    assert line.begun[0].time == pytest.approx(30.0, abs=0.5)


@pytest.mark.parametrize("standing", ["paused", "at a task"])
def test_carried_away_while_it_stands(standing: str) -> None:
    """What it was about to do is not done elsewhere: it takes up what is in force where it is put down."""
    orders = (Order(0.0, "MN", "start"), Order(10.0, "MT:90", "turn"), Order(10.0, "MN", "on"))
    tasks = (Wait(20.0),) if standing == "at a task" else ()
    plan = Plan(WAY, (orders[0], Order(4.0, "MN", "here", tasks), *orders[1:]), 30.0)
    moved: list[float] = []

    def each(now: Line) -> None:
        if not moved and now.x > 3.9 and (not tasks or now.executor.status is Status.AT_TASK):
            if not tasks:
                now.executor.pause()
            now.x = 20.0
            moved.append(now.time)
        elif moved and not tasks and now.time > moved[0] + 10.0:
            now.executor.resume()

    line = Line(Executor(plan), right(WAY)).run(each=each)
    assert line.executor.status is Status.COMPLETED, told(line)
    assert turned_at(line) == []
    assert line.x == pytest.approx(30.0, abs=0.5)


@some
@given(st.floats(0.0, 70.0), st.booleans())
def test_aborted_at_any_time_it_stands_for_good(when: float, paused: bool) -> None:
    plan = with_tasks()
    line = Line(Executor(plan), right(plan.path))

    def each(now: Line) -> None:
        if now.time >= when:
            if paused:
                now.executor.pause()
            now.executor.abort("the lift is full")

    line.run(each=each)
    executor = line.executor
    if executor.status is Status.COMPLETED:
        return
    assert executor.status is Status.ABORTED
    assert executor.why == "the lift is full"
    begun, switches, do = len(line.begun), len(executor.switches), executor.do
    assert do.halt
    assert do.task is None
    executor.resume()
    executor.pause()
    executor.ended(True, "late")
    executor.done()
    for number in range(5):
        executor.believe(seen_at(plan.path.along, 25.0))
        executor.move(line.time + 100.0 * number, line.travelled)
    assert executor.status is Status.ABORTED
    assert (len(line.begun), len(executor.switches)) == (begun, switches)
    assert executor.do == do


def test_caution_rules_how_long_it_looks() -> None:
    caution = ExecutorSettings(patience=5.0)
    line = Line(learnt(settings=caution), lambda number, x: lost(COUNT)).run()
    assert line.executor.why == "localising for 5 s"
    assert line.time == pytest.approx(5.0, abs=2 * STEP)
