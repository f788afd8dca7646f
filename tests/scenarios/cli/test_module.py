"""``refseq module``: wrong input is one line, and each command joins a link, here one in this thread, in its role."""

import re
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.access.policy import AccessPolicy
from refseq.errors import RefseqError
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.modules.heads import Parts, head_bytes
from refseq.modules.link import opened
from refseq.modules.messages import (
    BELIEF,
    BELIEFS,
    COMMANDS,
    HEAD,
    ORDERS,
    STATE,
    STEPS,
    VIEWS,
    Command,
    OrderHead,
    Step,
    belief_in,
    head_of,
    part,
    view_parts,
)
from refseq.serve.answers import answer_to
from refseq.view import View
from refseq_bench.robots.state import RobotState
from refseq_bench.sim.modules.state import state_bytes
from tests.refseq.viewer.readback import values
from tests.scenarios.conftest import Refseq
from tests.sim.modules.local_link import LocalLink
from tests.support import corridor_drive
from tests.worlds.conftest import SMALL

MAP = "corridor.refseq"
COMMAND_NAMES = ("robot", "control", "localiser", "mission", "viewer")
WITH_MAP = ("robot", "localiser", "mission", "viewer")
TOKEN = "3f9ab27c0d1e4856"


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return [replace(view, images={}) for view in corridor_drive(np.random.default_rng(1), 6, size=24)]


@pytest.fixture(scope="module")
def desk(drive: list[View], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a map that the laser learnt, and with one that is damaged."""
    folder = tmp_path_factory.mktemp("desk")
    learn(drive).save(folder / MAP)
    whole = (folder / MAP).read_bytes()
    (folder / "half.refseq").write_bytes(whole[: len(whole) // 2])
    (folder / "text.refseq").write_text("no map")
    return folder


@pytest.fixture
def here(desk: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder to work in with the maps, in a home of its own, where no token is set."""
    for path in desk.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("REFSEQ_TOKEN", raising=False)
    return tmp_path


@pytest.fixture
def no_link(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bad input is found before anybody connects or listens."""
    monkeypatch.setattr("refseq.modules.link.opened", lambda *_, **__: pytest.fail("a link is opened"))


def refused(refseq: Refseq, *words: str | Path) -> str:
    """The line in which a command is refused."""
    answer = refseq("module", *words)
    assert answer.code == 2, answer
    assert answer.out == ""
    assert len(answer.err.strip().splitlines()) == 1, answer.err
    return answer.err


@pytest.mark.usefixtures("no_link")
@pytest.mark.parametrize("command", WITH_MAP)
@pytest.mark.parametrize(
    ("file", "told"),
    [("none.refseq", "none.refseq: "), ("half.refseq", "half.refseq: "), ("text.refseq", "text.refseq: ")],
)
def test_a_map_that_is_none_is_refused(refseq: Refseq, here: Path, command: str, file: str, told: str) -> None:
    more = ("--rrd", "x.rrd") if command == "viewer" else ()
    assert told in refused(refseq, command, file, *more)
    assert not (here / "x.rrd").exists()


@pytest.mark.usefixtures("no_link")
@pytest.mark.parametrize("command", COMMAND_NAMES)
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("AT", "10.1.2.3"), r"host '10\.1\.2\.3' is reached from other machines; valid is --token with 16 characters"),
        (("--token", "short"), "token of 5 characters: valid are 16 or more, letters and digits"),
        (("--port", "0"), "--port.*0.*(range|valid)"),
        (("--port", "door"), "--port.*door.*valid"),
    ],
)
def test_an_address_or_a_token_that_is_none_is_refused(
    refseq: Refseq, here: Path, command: str, words: tuple[str, ...], told: str
) -> None:
    at = "--host" if command == "robot" else "--address"
    file = (MAP,) if command in WITH_MAP else ()
    more = ("--rrd", "x.rrd") if command == "viewer" else ()
    line = refused(refseq, command, *file, *(at if word == "AT" else word for word in words), *more)
    assert re.search(told, line), line


@pytest.mark.usefixtures("no_link")
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("mission", MAP, "[LD_LX]"), "mission '[LD_LX]', column 5: "),
        (("mission", MAP, "LA3"), "mission 'LA3', column 1: "),
        (("mission", MAP, "[LA3]"), "mission [LA3], step 1: nobody has said where LA3 is; "),
        (("mission", MAP, "[LA3]", "--landmark", "LA3=far"), "mission [LA3], step 1: LA3 is at 'far'; valid "),
        (("mission", MAP, "--landmark", "LA3=2"), "--landmark goes with a mission of landmarks; "),
        (("mission", MAP, "--from", "west:1", "--to", "corridor:3"), "path 'west' is unknown; valid are corridor"),
        (("mission", MAP, "--to", "corridor:99"), "corridor:99"),
        (("mission", MAP, "--timeout", "0"), "--timeout 0 is not valid; valid is a time above 0 s"),
        (("mission", MAP, "--timeout", "nan"), "--timeout nan is not valid; valid is a time above 0 s"),
        (("robot", MAP, "--filmstrip", "1"), "--filmstrip: nobody stands by here; valid is refseq mission run"),
        (("robot", MAP), "the map does not tell its world; valid is to say it: --world"),
        (("robot", MAP, "--from", "west:1", "--to", "corridor:3"), "path 'west' is unknown; valid are corridor"),
        (
            ("viewer", MAP, "--rrd", "x.rrd", "--serve", "9090"),
            "--rrd and --serve exclude each other; valid is one of them, or none",
        ),
        (("viewer", MAP, "--rrd", "no/x.rrd"), "there is no folder no"),
        (("viewer", MAP, "--connect", "rerun+http://127.0.0.1:9/proxy"), "nobody answers"),
        (("control", MAP), MAP),
        (
            ("control", "--address", "robot.local"),
            "host 'robot.local' is reached from other machines; valid is --token",
        ),
        (("control", "--address", "no address"), "host 'no address' is reached from other machines; valid is --token"),
        (("control", "--token", "with space and more"), "token of 19 characters: valid are 16 or more"),
        (("control", "--port", "65536"), "65536"),
        (("driver",), "command 'module driver' is unknown; valid are robot, control, localiser, mission, viewer"),
    ],
)
def test_other_bad_input_is_one_line(refseq: Refseq, here: Path, words: tuple[str, ...], told: str) -> None:
    assert told in refused(refseq, *words)
    assert not (here / "x.rrd").exists()


def test_a_port_that_is_taken_cannot_be_listened_at(refseq: Refseq, here: Path) -> None:
    """Told as one line; the connection itself is the library's."""
    pytest.importorskip("zenoh")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        told = f"127.0.0.1 port {port}: cannot be listened at; valid is a free port of an address of this machine"
        policy = AccessPolicy("127.0.0.1", port, TOKEN)
        with pytest.raises(RefseqError, match=told), opened(policy, serves=True, waits=pytest.fail):
            pytest.fail("it listens")


@pytest.mark.parametrize("command", COMMAND_NAMES)
def test_help_tells_of_the_address_and_the_token(refseq: Refseq, command: str) -> None:
    answer = refseq("module", command, "--help")
    assert (answer.code, answer.err) == (0, "")
    assert ("--host" if command == "robot" else "--address") in answer.out
    assert "--token" in answer.out
    assert "REFSEQ_TOKEN" in answer.out


def test_help_lists_all_modules(refseq: Refseq) -> None:
    answer = refseq("module", "--help")
    assert answer.code == 0
    assert all(re.search(rf"\b{command}\b", answer.out) for command in COMMAND_NAMES)


# --- what each command does on a link ---


class LiveLink(LocalLink):
    """One on which the robot begins to speak when the module has subscribed to all that it hears."""

    def __init__(self) -> None:
        super().__init__()
        self.begin: Callable[[], None] = lambda: None

    def watch(self, told: Callable[[str, bool], None]) -> None:
        super().watch(told)
        self.begin()


class Opened:
    """A link in this thread, on which the test plays the robot; and with whom it was opened."""

    def __init__(self) -> None:
        self.link = LiveLink()
        self.policies: list[tuple[AccessPolicy, bool]] = []

    @contextmanager
    def open(self, policy: AccessPolicy, *, serves: bool, waits: Any) -> Iterator[LocalLink]:
        self.policies.append((policy, serves))
        yield self.link

    def say(self, topic: str, parts: Parts) -> None:
        self.link.publisher(topic, keep=100)(parts)

    def step(self, number: int, *more: tuple[str, bytes], over: str = "", view: int | None = None) -> None:
        head = Step("a drive", number, 0.1 * number, 0.1 * number, 0.0, "robuter", view=view, over=over)
        self.say(STEPS, [(HEAD, head_bytes(head)), (STATE, state_bytes(RobotState())), *more])

    def heard(self, topic: str) -> list[Parts]:
        found: list[Parts] = []
        self.link.subscribe(topic, found.append)
        return found


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Opened:
    found = Opened()
    monkeypatch.setattr("refseq.modules.link.opened", found.open)
    return found


def test_the_localiser_answers_each_view_until_the_drive_is_over(
    refseq: Refseq, here: Path, robot: Opened, drive: list[View]
) -> None:
    said = robot.heard(BELIEFS)
    answered = 0

    def end(_parts: Parts) -> None:
        nonlocal answered
        answered += 1
        if answered == len(drive):
            robot.step(0, over="completed")

    robot.link.subscribe(BELIEFS, end)
    for number, view in enumerate(drive):
        robot.say(VIEWS, view_parts("a drive", number, view))
    words = ("--address", "10.1.2.3", "--port", "7000", "--token", TOKEN)
    answer = refseq("module", "localiser", MAP, *words)
    assert (answer.code, answer.err) == (0, "")
    assert robot.policies == [(AccessPolicy("10.1.2.3", 7000, TOKEN), False)]
    assert robot.link.roles == {"localiser"}
    beliefs = [belief_in(part(parts, BELIEF) or b"") for parts in said]
    assert [belief.view for belief in beliefs] == list(range(len(drive)))
    alone = Localiser(Map.load(here / MAP))
    for found, view in zip(beliefs, drive, strict=True):
        assert np.array_equal(found.belief.places, alone.update(view).places)


def test_control_answers_a_step_and_tells_who_comes(refseq: Refseq, here: Path, robot: Opened) -> None:
    said = robot.heard(COMMANDS)
    robot.link.join("robot")

    def speak() -> None:
        robot.step(0)
        halt = OrderHead("a drive", 0, 1, "MN:12", True, "", "", "under way", 0, 0.0, (), ())
        robot.say(ORDERS, [(HEAD, head_bytes(halt))])
        robot.step(1, over="completed")

    robot.link.begin = speak
    answer = refseq("module", "control")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.splitlines() == ["robot: is there"]
    assert [head_of(Command, parts) for parts in said] == [Command("a drive", 0, halt=True)]
    [(policy, serves)] = robot.policies
    assert (policy.host, policy.port, serves) == ("127.0.0.1", 7447, False)
    assert len(policy.token) >= 16, "this user's own"


def test_a_mission_that_is_not_completed_is_told_and_fails(refseq: Refseq, here: Path, robot: Opened) -> None:
    said = robot.heard(ORDERS)
    robot.step(0)
    robot.step(1, over="aborted")
    answer = refseq("module", "mission", MAP, "--by-odometry")
    assert answer.code == 1
    assert answer.err.startswith("not completed: ")
    assert len(answer.err.splitlines()) == 1
    assert head_of(OrderHead, said[0]).answers == 0


def test_the_viewer_writes_what_came(refseq: Refseq, here: Path, robot: Opened, drive: list[View]) -> None:
    map_ = Map.load(here / MAP)
    localiser = Localiser(map_)
    beliefs = [localiser.update(view) for view in drive]

    def speak() -> None:
        for number, (view, belief) in enumerate(zip(drive, beliefs, strict=True)):
            robot.say(VIEWS, view_parts("a drive", number, view))
            robot.step(number, (BELIEF, answer_to(map_, number, view, belief).json), view=number)
        robot.step(len(drive), over="completed")

    robot.link.begin = speak
    answer = refseq("module", "viewer", MAP, "--rrd", "x.rrd")
    assert (answer.code, answer.err) == (0, "")
    assert "x.rrd: open it with " in answer.out
    shown = values(here / "x.rrd", "/lost/map/chain", "Scalars:scalars", "view")
    assert [lost for (lost,) in shown] == [belief.lost for belief in beliefs]
    assert f"showed {len(drive)} views" in answer.out


class Crew:
    """Control and a mission that is over with the step of a number, on the link of a robot; they leave behind it."""

    def __init__(self, link: LocalLink, last: int, over: str) -> None:
        self.link, self.last, self.over = link, last, over
        link.subscribe(STEPS, self.hear)
        for role in ("control", "mission"):
            link.join(role)

    def hear(self, parts: Parts) -> None:
        step = head_of(Step, parts)
        if step.over:
            for role in ("control", "mission"):
                self.link.leave(role)
            return
        command = Command(step.drive, step.number, halt=True, over=self.over if step.number == self.last else "")
        self.link.publisher(COMMANDS)([(HEAD, head_bytes(command))])


@pytest.mark.parametrize(("over", "code"), [("completed", 0), ("failed", 1)])
def test_the_robot_ends_as_the_mission_does(refseq: Refseq, here: Path, robot: Opened, over: str, code: int) -> None:
    (here / "small.toml").write_text(SMALL.format(top="", end=""))
    Crew(robot.link, 3, over)
    drive = ("--world", "small.toml", "--light", "18:00", "--robot", "robuter", "--by-odometry")
    answer = refseq("module", "robot", MAP, *drive, "--host", "10.1.2.3", "--token", TOKEN)
    assert (answer.code, answer.err) == (code, "")
    assert robot.policies == [(AccessPolicy("10.1.2.3", 7447, TOKEN), True)]
    lines = answer.out.splitlines()
    assert "robuter in small.toml: listens at 10.1.2.3 port 7447" in lines
    assert lines[-1] == f"the mission is {over}; no view was answered"
    steps = [head_of(Step, parts) for parts in robot.link.kept[STEPS]]
    assert [step.number for step in steps] == [0, 1, 2, 3, 4]
    assert [step.over for step in steps] == ["", "", "", "", over]
