"""A session at the controls: where views are taken, what pausing does, deadman, stops, and doing the same again."""

import math
from collections.abc import Sequence
from itertools import pairwise

import pytest

from refseq_bench import robots
from refseq_bench.robots import Cause
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.recorder import RecordedView
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.teleop.commands import Button, Commands, CommandSource, SessionPhase, SessionStatus
from refseq_bench.sim.teleop.script import CommandLog, ScriptSource, parse, printed
from refseq_bench.sim.teleop.session import AbortedError, run_session
from refseq_bench.worlds.build import World
from tests.sim.drives.behaving_in import BOX, corridor

CAMERALESS = BenchSettings(RendererKind.NONE, cameras=())
BY_TIME = Trigger(distance=None, time=0.5)
TOUCHED = BOX.format(x=5, y=0)


class Watched:
    """A source that keeps each status that it was shown."""

    def __init__(self, source: CommandSource) -> None:
        self._source, self.shown = source, list[SessionStatus]()

    def commands(self, status: SessionStatus) -> Commands:
        self.shown.append(status)
        return self._source.commands(status)


def sat(
    text: str, sampling: Trigger | None = None, world: World | None = None, robot: str = "robuter"
) -> tuple[list[RecordedView], list[SessionStatus]]:
    source = Watched(ScriptSource(parse(text)))
    with Bench(world or corridor(), robots.load(robot), seed=3, settings=CAMERALESS) as bench:
        return list(run_session(bench, source, sampling)), source.shown


def times(taken: Sequence[RecordedView]) -> list[float]:
    return [one.view.time for one in taken]


def test_by_timer_views_are_evenly_apart_also_while_it_stands() -> None:
    taken, _ = sat("0.2 forward\n1.2 halt\n4 stop", BY_TIME)
    assert times(taken) == pytest.approx([0.52 * n for n in range(8)], abs=1e-6)  # the first period not before 0.5 s


def test_by_motion_views_are_as_far_apart_as_asked_and_none_while_it_stands() -> None:
    taken, shown = sat("0 forward\n6 halt\n10 left\n16 stop", Trigger(distance=0.5, turn=math.radians(30)))
    ahead = [one for one in taken if one.view.time < 6]
    turning = [one for one in taken if one.view.time > 10]
    assert len(ahead) == 5
    assert all(one.view.distance == pytest.approx(0.5, abs=0.4 * CONTROL_PERIOD + 1e-3) for one in ahead[1:])
    assert not [time for time in times(taken) if 7 < time < 10]
    assert len(turning) >= 4
    assert all(one.view.turn == pytest.approx(math.radians(30), abs=0.03) for one in turning[1:])
    assert shown[-1].travelled == pytest.approx(2.4, abs=0.1), "six seconds at 0.4 m/s, and some while it turns"
    assert all(one.progress <= after.progress for one, after in pairwise(taken))


def test_by_hand_views_are_taken_when_asked_for_and_only_then() -> None:
    taken, shown = sat("0 forward\n1 sample\n2.5 sample\n4 stop")
    assert times(taken) == pytest.approx([0.0, 1.0, 2.52], abs=1e-6)
    assert [status.count for status in shown][-1] == 3


def test_a_view_asked_for_begins_the_next_stretch_anew() -> None:
    taken, _ = sat("0.3 sample\n1.4 stop", BY_TIME)
    assert times(taken) == pytest.approx([0.0, 0.32, 0.84, 1.36], abs=1e-6)


@pytest.mark.parametrize("sampling", [BY_TIME, Trigger(distance=0.2), None])
def test_paused_there_are_no_views_and_motion_counts_on(sampling: Trigger | None) -> None:
    taken, shown = sat("0 forward\n2 pause\n5 resume\n7 stop", sampling)
    assert not [time for time in times(taken) if 2 - 1e-6 <= time < 5 - 1e-6]
    assert {s.phase for s in shown if 2.02 < s.time < 4.98} == {SessionPhase.PAUSED}
    if sampling is not None:
        resumed = next(one for one in taken if one.view.time >= 5 - 1e-6)
        assert resumed.view.time == pytest.approx(5.0, abs=1e-6), "one was due"
        assert resumed.view.distance > 1.0, "the robot was led on meanwhile"


def test_before_the_start_the_robot_is_led_without_views() -> None:
    taken, shown = sat("0 forward\n2 halt\n4 start\n5 stop", BY_TIME)
    assert times(taken)[0] == pytest.approx(4.0, abs=1e-6)
    assert taken[0].view.distance == 0.0
    assert taken[0].odometry.x > 0.5
    assert shown[0].phase is SessionPhase.READY


def test_who_takes_his_hand_away_lets_the_robot_stop_by_itself() -> None:
    """The deadman is the robot's own watch for commands: half a second without one, and it says so."""
    _, shown = sat("0 forward\n2 away\n4 forward\n6 stop")
    stopped = [status for status in shown if Cause.NO_COMMAND in {stop.cause for stop in status.stops}]
    assert 2.5 - 0.1 <= stopped[0].time <= 2.5 + 0.2
    assert next(s for s in shown if s.time > 3.9).twist.linear == pytest.approx(0.0, abs=0.02)
    assert shown[-1].twist.linear == pytest.approx(0.4, abs=0.05), "the next command frees it"
    assert not shown[-1].stops


@pytest.mark.quick_cases("robuter")
@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_a_hand_that_asks_for_too_much_gets_what_the_robot_may(robot: str) -> None:
    limits = robots.load(robot).limits
    _, shown = sat("1 forward 10\n5 left 10\n9 stop", robot=robot)
    speeds, rates = [s.twist.linear for s in shown], [s.twist.angular for s in shown]
    assert 0.8 * limits.speed < max(speeds) < 1.25 * limits.speed
    assert 0.5 * limits.turn_rate < max(rates) < 1.3 * limits.turn_rate


def test_the_robot_stops_itself_before_what_it_sees_and_can_be_led_away() -> None:
    taken, shown = sat("0 forward\n12 back\n16 stop", Trigger(distance=0.3), corridor(things=TOUCHED))
    before = next(s for s in shown if s.time > 11.9)
    assert Cause.SONAR in {stop.cause for stop in before.stops}
    assert before.twist.linear == pytest.approx(0.0, abs=0.02)
    assert not shown[-1].stops
    assert shown[-1].twist.linear < -0.2
    assert len(taken) > 3


def test_a_robot_that_touches_something_stops_and_all_its_views_are_kept() -> None:
    """Backwards it has no sonar that stops it: the bumper does."""
    taken, shown = sat("0 back\n8 forward 0.2\n10 stop", BY_TIME)
    assert Cause.BUMPER in {stop.cause for status in shown for stop in status.stops}
    assert not shown[-1].stops
    assert times(taken) == pytest.approx([0.52 * n for n in range(len(taken))], abs=1e-6)
    assert times(taken)[-1] > 9.3


def test_an_emergency_stop_holds_until_it_is_released() -> None:
    _, shown = sat("0 forward\n2 emergency\n5 release\n9 stop")
    held = [status for status in shown if 2.2 < status.time < 4.9]
    assert all(Cause.EMERGENCY in {stop.cause for stop in status.stops} for status in held)
    assert held[-1].twist.linear == pytest.approx(0.0, abs=0.02)
    assert shown[-1].twist.linear > 0.3


def test_a_button_that_does_nothing_says_so() -> None:
    class Person:
        def commands(self, status: SessionStatus) -> Commands:
            assert status.time < 1.0
            asked = {0: Button.SAMPLE, 5: Button.START, 10: Button.STOP}
            number = round(status.time / CONTROL_PERIOD)
            return Commands(buttons=(asked[number],) if number in asked else ())

    source = Watched(Person())
    with Bench(corridor(), robots.load("robuter"), settings=CAMERALESS) as bench:
        taken = list(run_session(bench, source, None))
    assert source.shown[1].note == "sample does nothing while ready; valid are start, stop, abort, emergency, release"
    assert source.shown[6].note == ""
    assert times(taken) == pytest.approx([0.2])


def test_who_gives_up_is_told_that_nothing_is_kept() -> None:
    with pytest.raises(AbortedError, match=r"^aborted at 2\.0 s, after 4 views: none is kept$"):
        sat("0 forward\n2 abort", BY_TIME)


def test_who_stops_before_the_start_has_no_view() -> None:
    class Person:
        def commands(self, status: SessionStatus) -> Commands:
            return Commands(buttons=(Button.STOP,))

    with Bench(corridor(), robots.load("robuter"), settings=CAMERALESS) as bench:
        assert list(run_session(bench, Person(), None)) == []


def test_the_rate_is_that_of_the_last_views() -> None:
    _, shown = sat("20 stop", Trigger(distance=None, time=2.0))
    assert shown[-1].rate == pytest.approx(30.0, rel=0.01)
    assert shown[-1].view is not None
    assert shown[-1].moved.time <= 2.0 + 1e-6


def test_the_rate_is_that_of_the_last_ten_steps_whatever_was_before() -> None:
    moments = [5.0, 10.0, 15.0, *(15.0 + 0.4 * k for k in range(1, 11))]
    _, shown = sat("\n".join([*(f"{moment:g} sample" for moment in moments), "20 stop"]))
    assert shown[-1].rate == pytest.approx(60 / 0.4, rel=0.01)


def test_the_same_script_is_the_same_drive_and_so_is_what_was_noted_of_it() -> None:
    """As a person leads it, in bends and odd moments; then by a script of what was noted."""

    class Person:
        def commands(self, status: SessionStatus) -> Commands:
            phase = round(status.time / CONTROL_PERIOD)
            twist = None if 60 < phase < 66 else robots.Twist(0.3 + 0.1 * math.sin(phase), 0.2 * math.cos(0.1 * phase))
            buttons = {0: (Button.START,), 70: (Button.PAUSE,), 80: (Button.RESUME,), 33: (Button.SAMPLE,)}
            return Commands(twist, (Button.STOP,) if phase >= 120 else buttons.get(phase, ()))

    def run(source: CommandSource) -> list[RecordedView]:
        with Bench(corridor(), robots.load("robuter"), seed=3, settings=CAMERALESS) as bench:
            return list(run_session(bench, source, Trigger(distance=0.2)))

    noting = CommandLog(Person())
    first = run(noting)
    text = printed(noting.script)
    for again in (run(ScriptSource(parse(text))), run(ScriptSource(parse(text)))):
        assert [one.view.truth for one in again] == [one.view.truth for one in first]
        assert [one.odometry for one in again] == [one.odometry for one in first]
        assert times(again) == times(first)
        scans = [(one.view.scan, two.view.scan) for one, two in zip(again, first, strict=True)]
        assert all(a is not None and b is not None and (a.ranges == b.ranges).all() for a, b in scans)
    assert len(first) > 5
