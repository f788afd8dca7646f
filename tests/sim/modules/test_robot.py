"""The robot's side of a link in this thread, on a bench of a few lines and a clock that the test winds."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq.modules.heads import Parts, head_bytes
from refseq.modules.messages import (
    BELIEF,
    BELIEFS,
    COMMANDS,
    HEAD,
    STEPS,
    VIEWS,
    BeliefHead,
    Command,
    Step,
    head_of,
    part,
)
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq_bench.robots import Twist
from refseq_bench.robots.state import RobotState
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.modules.robot import ANSWER, FAREWELL, FRESH, RobotModule, RobotSettings, latency_line
from refseq_bench.sim.realtime import RealTimePacer
from tests.sim.modules.local_link import LocalLink

ROLES = ("control", "mission", "localiser")
SPEED = 0.5
NEVER = Trigger(distance=1000.0)
UNTOUCHED = SimpleNamespace(touches=(), look=tuple)
"""Touches on a line where there is nothing."""


class Clock:
    """Time that goes by while somebody sleeps."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


class StraightBench:
    """A robot on a line that goes at once as it is told."""

    def __init__(self) -> None:
        self.time, self.x, self.twists = 0.0, 0.0, list[Twist]()
        self.robot, self.scan_due = SimpleNamespace(name="robuter"), False
        self._scan = Scan(np.ones(5, np.float32))

    @property
    def pose(self) -> Pose:
        return Pose(self.x, 0.0, 0.0)

    odometry = pose

    @property
    def state(self) -> RobotState:
        return RobotState(time=self.time, distance=self.x)

    def drive(self, twist: Twist) -> None:
        self.twists.append(twist)
        self.time += CONTROL_PERIOD
        self.x += twist.linear * CONTROL_PERIOD

    def scan(self) -> Scan:
        return self._scan

    def sense(self) -> View:
        return View(self.time, scan=self._scan)


class Played:
    """A drive of the module; ``answer`` gives what control says to each step, None: nothing."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, settings: RobotSettings) -> None:
        self.clock, self.bench, self.link, self.told = Clock(), StraightBench(), LocalLink(), list[str]()
        monkeypatch.setattr("refseq_bench.sim.modules.robot.time", self.clock)
        monkeypatch.setattr("refseq_bench.sim.modules.robot.TouchLog", lambda _bench: UNTOUCHED)
        bench: Any = self.bench
        self.module = RobotModule(bench, self.link, "this drive", settings, self.told.append)
        self.module._pacer = RealTimePacer(clock=self.clock.monotonic, sleep=self.clock.sleep)
        self.answer: Callable[[Step], Command | None] = lambda _step: None
        self.times: list[float] = []  # when each step was told of [s]
        self.link.subscribe(STEPS, self._step)

    def _step(self, parts: Parts) -> None:
        self.times.append(self.clock.now)
        assert len(self.times) < 1000, "it goes on for ever"
        step = head_of(Step, parts)
        if step.over:
            for role in ROLES:
                self.link.leave(role)
        elif (command := self.answer(step)) is not None:
            self.say(COMMANDS, [(HEAD, head_bytes(command))])

    def say(self, topic: str, parts: Parts) -> None:
        self.link.publisher(topic)(parts)

    def believe(self, view: int, drive: str = "this drive", data: bytes = b"{}") -> None:
        self.say(BELIEFS, [(HEAD, head_bytes(BeliefHead(drive, view))), (BELIEF, data)])

    def run(self, *roles: str) -> list[Step]:
        for role in roles or ROLES:
            self.link.join(role)
        self.over = self.module.run()
        return [head_of(Step, parts) for parts in self.link.kept[STEPS]]


def go(step: Step, until: int, **more: Any) -> Command:
    """Go on, until a step of this number: there the mission is completed."""
    if step.number >= until:
        return Command(step.drive, step.number, over="completed")
    return Command(step.drive, step.number, SPEED, 0.0, number=1, behaviour="MN:12", **more)


def test_damaged_foreign_and_late_messages_are_told_or_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drive is that of a link on which they were never said."""
    plain = Played(monkeypatch, RobotSettings(NEVER, realtime=True, localised=False))
    plain.answer = lambda step: go(step, 6)
    hurt = Played(monkeypatch, RobotSettings(NEVER, realtime=True, localised=False))

    def answer(step: Step) -> None:
        away = {"linear": -3.0, "over": "failed"}
        hurt.say(COMMANDS, [(HEAD, b"{")])
        hurt.say(COMMANDS, [])
        hurt.say(BELIEFS, [(HEAD, b'{"drive": "this drive"}')])
        hurt.say(COMMANDS, [(HEAD, head_bytes(Command("another drive", step.number, **away)))])  # type: ignore[arg-type]
        hurt.say(COMMANDS, [(HEAD, head_bytes(go(step, 6)))])
        hurt.say(COMMANDS, [(HEAD, head_bytes(Command("this drive", step.number - 1, **away)))])  # type: ignore[arg-type]

    hurt.answer = answer
    assert hurt.run() == plain.run()
    assert (hurt.over, plain.over) == ("completed", "completed")
    assert hurt.bench.x == pytest.approx(6 * CONTROL_PERIOD * SPEED)
    damaged = [line for line in hurt.told if "is no" in line]
    assert [line.partition(": ")[0] for line in damaged[:3]] == ["a message is no Command"] * 2 + [
        "a message is no BeliefHead"
    ]
    assert len(damaged) == 3 * 7
    assert not [line for line in plain.told if "is no" in line]


def test_without_a_localiser_no_view_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    played = Played(monkeypatch, RobotSettings(Trigger(time=CONTROL_PERIOD), localised=False))
    played.answer = lambda step: go(step, 4)
    steps = played.run("control", "mission")
    assert played.over == "completed"
    assert [step.view for step in steps] == [None] * len(steps)
    assert played.link.kept[VIEWS] == []
    assert latency_line(played.module.latency) == "no view was answered"


def test_in_real_time_an_old_command_is_not_carried_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Control falls silent at the third step, and comes back at the thirtieth: in between the robot comes to stand."""
    played = Played(monkeypatch, RobotSettings(NEVER, realtime=True, localised=False))
    silent = range(3, 30)
    played.answer = lambda step: None if step.number in silent else go(step, 40)
    steps = played.run("control", "mission")
    last = silent.start - 1  # the step that was answered last
    for step in steps[last + 1 : silent.stop]:
        began = played.times[step.number - 1]
        fresh = began - played.times[last] < FRESH - CONTROL_PERIOD
        old = began - played.times[last] > FRESH
        if fresh:
            assert step.command is not None, step
            assert step.command.answers == last
        if old:
            assert step.command is None, step
    stood = [step.number for step in steps if step.command is None and step.number > 0 and not step.over]
    assert stood == list(range(stood[0], silent.stop + 1))
    assert 0 < len(stood) < len(silent)
    assert all(played.bench.twists[number - 1] == Twist() for number in stood)
    assert played.bench.x == pytest.approx((40 - len(stood)) * CONTROL_PERIOD * SPEED)
    assert played.over == "completed"


@pytest.mark.parametrize("slow", ["old", "seldom"])
def test_commands_that_are_late_for_long_are_told_once_and_when_they_are_in_time_again(
    monkeypatch: pytest.MonkeyPatch, slow: str
) -> None:
    """They answer what was sensed 20 steps ago, 0.8 s, or come every 40 steps; a short silence is not told."""
    played = Played(monkeypatch, RobotSettings(NEVER, realtime=True, localised=False))
    lagging, until = range(60, 200), 320

    def answer(step: Step) -> Command | None:
        if step.number in range(3, 23):
            return None
        command = go(step, until)
        if step.number not in lagging:
            return command
        if slow == "old":
            return replace(command, answers=step.number - 20)
        return None if step.number % 40 else command

    played.answer = answer
    steps = played.run("control", "mission")
    late, again = (line for line in played.told if line.startswith("control: ") and not line.startswith("control: is "))
    assert "more than 0.5 s ago" in late
    assert again == "control: its commands are in time again"
    stood = [step.number for step in steps if step.command is None and step.number in lagging]
    assert len(stood) > len(lagging) / 2
    assert played.over == "completed"


def test_in_real_time_the_robot_stands_while_the_localiser_lags(monkeypatch: pytest.MonkeyPatch) -> None:
    """It goes on for ``ANSWER`` seconds, and again when all views are answered; no belief is told twice."""
    played = Played(monkeypatch, RobotSettings(NEVER, realtime=True))
    back, end = 80, 90

    def answer(step: Step) -> Command:
        if step.number == back:
            played.believe(0, drive="another drive", data=b"foreign")
            played.believe(7, data=b"of no view")
            played.believe(0, data=b"")
            played.believe(0, data=b"mine")
            played.believe(0, data=b"again")
        return go(step, end)

    played.answer = answer
    steps = played.run()
    held = [step.number for step in steps if step.held]
    assert {step.held for step in steps} == {"", "localiser"}
    assert held == list(range(held[0], back + 1))
    waited = played.times[held[0]] - played.times[0]
    assert ANSWER <= waited < ANSWER + 4 * CONTROL_PERIOD
    assert all(played.bench.twists[number - 1] == Twist() for number in held)
    beliefs = {
        number: part(parts, BELIEF) for number, parts in enumerate(played.link.kept[STEPS]) if part(parts, BELIEF)
    }
    assert beliefs == {back + 1: b"mine"}
    assert len(played.module.latency) == 1
    assert played.module.latency[0] == pytest.approx(played.times[back] - played.times[0])
    assert played.over == "completed"


def test_the_robot_says_who_it_stands_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer may come and go; who is needed may not."""
    played = Played(monkeypatch, RobotSettings(NEVER, localised=False))

    def answer(step: Step) -> Command | None:
        if step.number == 2:
            played.link.join("viewer")
            played.link.leave("viewer")
            played.link.leave("mission")
            return None
        if step.number == 5:
            played.link.join("mission")
        return None if step.held == "mission" and step.number < 5 else go(step, 9)

    played.answer = answer
    steps = played.run("control", "mission")
    assert [step.number for step in steps if step.held] == [3, 4, 5]
    assert played.told[:5] == [
        "control: is there",
        "mission: is there",
        "viewer: is there",
        "viewer: is gone",
        "mission: is gone; the robot stands",
    ]
    assert played.over == "completed"


@pytest.mark.parametrize(
    ("latency", "line"),
    [
        ([], "no view was answered"),
        ([0.2], "1 views; from a view to its belief 200 ms in the median, 200 ms in 95 of 100, 200 ms at most"),
        (
            [0.001 * number for number in range(100, 0, -1)],
            "100 views; from a view to its belief 50 ms in the median, 96 ms in 95 of 100, 100 ms at most",
        ),
    ],
)
def test_how_long_beliefs_took_is_told_in_a_line(latency: list[float], line: str) -> None:
    assert latency_line(latency) == line


def test_a_module_that_does_not_leave_holds_the_robot_for_a_few_seconds_only(monkeypatch: pytest.MonkeyPatch) -> None:
    played = Played(monkeypatch, RobotSettings(NEVER, localised=False))
    played.answer = lambda step: go(step, 2)
    monkeypatch.setattr(played.module._news, "wait", played.clock.sleep)
    played.link.join("viewer")
    played.run("control", "mission")
    assert FAREWELL <= played.clock.now - played.times[-1] < FAREWELL + 1.0
