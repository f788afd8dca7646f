"""``refseq drive``: led by a script it is a recording as any other, the same each time; nothing half-written."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from refseq.logs import read_recording
from refseq.map.learning import learn
from refseq_bench.robots import Twist
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.drives.teleop import TeleopDrive, record_by_hand
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.teleop.commands import Button, Commands, SessionStatus
from tests.scenarios.conftest import Refseq
from tests.worlds.conftest import SMALL

SCRIPT = "0 forward 0.3\n4 left\n6 forward left 0.2\n8 sample\n9 halt\n10 stop\n"
LASER = ("--sensors", "laser")


@pytest.fixture
def plan(tmp_path: Path) -> str:
    """Path of a short corridor's plan."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL.format(top="", end=""))
    return str(path)


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    path = tmp_path / "keys.txt"
    path.write_text(SCRIPT)
    return path


def test_a_script_is_a_recording_as_any_other(plan: str, keys: Path, tmp_path: Path, refseq: Refseq) -> None:
    path = tmp_path / "out" / "drive.mcap"
    answer = refseq("record", plan, "--script", keys, *LASER, "--distance", "0.4", "--light", "18:00", "-o", path)
    assert answer.code == 0, answer.err
    read = read_recording(path)
    assert answer.out.startswith(f"{path}: {len(read.views)} views of laser, ")
    assert answer.out.splitlines()[0].endswith(" m in 10.0 s")
    assert read.complete
    assert len(read.views) >= 5
    assert 8.0 in [pytest.approx(view.time, abs=1e-6) for view in read.views]
    assert len(learn(read.views)) == len(read.views)
    told = read.metadata
    assert (told["name"], told["route"], told["light"]) == ("drive", "by hand from 0 m of forward", "18:00")
    assert told["controls"] == "0 forward 0.3 start\n" + SCRIPT.partition("\n")[2]
    config = json.loads(told["config"])
    assert config["trigger"] == {"distance": 0.4, "turn": None, "time": None}
    assert config["operator"] is None
    led = record(Drive(world=plan, renderer=RendererKind.NONE), tmp_path / "led.mcap").metadata
    assert set(told) == {*led, "name", "controls"}, "what a recording tells, and what is its own"


def test_notes_are_kept_and_told_line_by_line(plan: str, keys: Path, tmp_path: Path, refseq: Refseq) -> None:
    path = tmp_path / "drive.mcap"
    notes = "wet floor, door 3 half open; " * 8 + "\nled by \N{GREEK SMALL LETTER ALPHA}"
    answer = refseq("record", plan, "--script", keys, *LASER, "--notes", f" {notes}\n", "-o", path)
    assert answer.code == 0, answer.err
    assert read_recording(path).metadata["notes"].split("\n")[1] == "led by \N{GREEK SMALL LETTER ALPHA}"
    told = [line.strip() for line in refseq("log", "info", path).out.splitlines() if line.strip().startswith("notes:")]
    assert told == [f"notes: {line.strip()}" for line in notes.split("\n")]
    answer = refseq("record", plan, *LASER, "--notes", "bell \a", "-o", tmp_path / "other.mcap")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith("error: notes: '\\x07' is no character of a text; valid are ")
    assert not (tmp_path / "other.mcap").exists()


def test_the_same_script_is_the_same_file_and_a_recording_is_a_script(
    plan: str, keys: Path, tmp_path: Path, refseq: Refseq
) -> None:
    once, twice, again = (tmp_path / name / "drive.mcap" for name in ("once", "twice", "again"))
    for path, script in ((once, keys), (twice, keys), (again, once)):
        assert (
            refseq("record", plan, "--script", script, *LASER, "--distance", "0", "--time", "1", "-o", path).code == 0
        )
    assert once.read_bytes() == twice.read_bytes() == again.read_bytes()
    other = tmp_path / "other" / "drive.mcap"
    assert (
        refseq(
            "record", plan, "--script", keys, *LASER, "--distance", "0", "--time", "1", "--seed", "2", "-o", other
        ).code
        == 0
    )
    assert other.read_bytes() != once.read_bytes()


def test_by_hand_there_are_only_the_views_that_were_asked_for(
    plan: str, keys: Path, tmp_path: Path, refseq: Refseq
) -> None:
    path = tmp_path / "drive.mcap"
    assert (
        refseq("record", plan, "--script", keys, "--on-request", "--name", "two places", *LASER, "-o", path).code == 0
    )
    read = read_recording(path)
    assert [view.time for view in read.views] == pytest.approx([0.0, 8.0], abs=1e-6)
    assert read.metadata["name"] == "two places"
    assert json.loads(read.metadata["config"])["trigger"] is None


def test_where_it_starts_and_with_which_robot(plan: str, keys: Path, tmp_path: Path, refseq: Refseq) -> None:
    path = tmp_path / "drive.mcap"
    answer = refseq("record", plan, "--script", keys, *LASER, "--robot", "segway_rmp", "--start", "1.5", "-o", path)
    assert answer.code == 0, answer.err
    first = read_recording(path).views[0].truth
    assert first is not None
    assert first.x == pytest.approx(2.5, abs=0.05)
    assert read_recording(path).metadata["robot"] == "segway_rmp"


def test_a_robot_that_stops_itself_is_told_of_and_its_views_are_kept(plan: str, tmp_path: Path, refseq: Refseq) -> None:
    """Backwards out of the corridor's start, into nothing; forwards at its side wall."""
    script, path = tmp_path / "wall.txt", tmp_path / "drive.mcap"
    script.write_text("0 left\n3.9 forward\n14 stop")
    answer = refseq("record", plan, "--script", script, *LASER, "--distance", "0", "--time", "1", "-o", path)
    assert answer.code == 0, answer.err
    assert any("stopped at" in line and "sonar" in line for line in answer.out.splitlines())
    assert len(read_recording(path).views) == 14
    assert not list(tmp_path.glob("*partial*"))


def test_what_is_aborted_leaves_nothing_and_what_was_there_stays(plan: str, tmp_path: Path, refseq: Refseq) -> None:
    script, path = tmp_path / "abort.txt", tmp_path / "drive.mcap"
    script.write_text("0 forward\n3 abort")
    answer = refseq("record", plan, "--script", script, *LASER, "--distance", "0", "--time", "1", "-o", path)
    assert answer.code == 1
    assert answer.err.splitlines()[-1] == "aborted at 3.0 s, after 3 views: none is kept"
    assert not list(tmp_path.glob("*.mcap"))
    path.write_bytes(b"older")
    assert refseq("record", plan, "--script", script, *LASER, "-o", path).code == 1
    assert path.read_bytes() == b"older"
    assert [found.name for found in tmp_path.glob("*.mcap")] == ["drive.mcap"]


class Person:
    """Leads ahead from the start, and at a time presses a button or raises what keeps him from it."""

    def __init__(self, at: float, button: Button | None = None) -> None:
        self._at, self._button = at, button

    def commands(self, status: SessionStatus) -> Commands:
        if status.time < self._at or status.phase.over:
            return Commands(Twist(0.3, 0.0), (Button.START,) if status.time == 0 and self._at else ())
        if self._button is None:
            raise KeyboardInterrupt
        return Commands(buttons=(self._button,))


def led_by(person: Person, plan: str, path: Path) -> None:
    @contextmanager
    def controls(_: Bench) -> Iterator[Person]:
        yield person

    drive = Drive(world=plan, renderer=RendererKind.NONE)
    record_by_hand(TeleopDrive("x", drive, Trigger(distance=None, time=1.0)), path, controls)


def test_interrupted_it_keeps_its_views_and_what_was_asked_for(plan: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    with pytest.raises(KeyboardInterrupt) as stop:
        led_by(Person(2.5), plan, path)
    partial = tmp_path / "drive.partial.mcap"
    assert stop.value.__notes__ == [f"{partial} holds 3 views, incomplete: use it as it is, or record again"]
    assert not path.exists()
    assert len(read_recording(partial).views) == 3
    assert read_recording(partial).metadata["controls"] == "0 forward 0.3 start\n"


def test_stopped_before_the_first_view_nothing_is_written(plan: str, tmp_path: Path) -> None:
    path = tmp_path / "out" / "drive.mcap"
    with pytest.raises(ScenarioError, match=r"drive\.mcap is not written: no view was taken$"):
        led_by(Person(0.0, Button.STOP), plan, path)
    assert not path.parent.exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--script", "missing.txt"), "missing.txt: is no file; valid is a script of controls"),
        (("--script", "KEYS", "--behaviours", "MN:1"), "--behaviours and --script exclude each other"),
        (("--script", "KEYS", "--side", "0.3"), "--operator-style and --side are of who follows the route"),
        (("--behaviours", "MN:1", "--operator-style", "weaving"), "an operator's style or side and behaviours exclude"),
        (("--script", "KEYS", "--on-request", "--time", "2"), "--on-request and --time 2 exclude each other"),
        (("--script", "KEYS", "--time", "0"), "--time 0 is not valid; it should be above 0 and finite"),
        (
            ("--script", "KEYS", "--distance", "-1"),
            "--distance -1 is not valid; it should be above 0 and finite, or 0 for none by distance",
        ),
        (("--script", "KEYS", "--sensors", "sonar"), "sensor 'sonar' is not on robot 'robuter'"),
        (
            ("--script", "KEYS", "--renderer", "fast"),
            "--renderer 'fast' is not valid; valid are baked, filament, classic, none",
        ),
        (("--script", "KEYS", "--start", "99"), "start 99.0 m and end 6 m are no stretch"),
        (("--script", "KEYS", "--robot", "r2d2"), "r2d2"),
        (("--script", "BAD"), "bad.txt, line 1, column 3: 'forwad' is not valid"),
        (("--script", "LED"), "led.mcap: was not led by hand"),
        (("--script", "BYTES"), "bytes.txt: cannot be read: not UTF-8 text"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    plan: str, keys: Path, tmp_path: Path, refseq: Refseq, words: tuple[str, ...], told: str
) -> None:
    (tmp_path / "bad.txt").write_text("1 forwad\n2 stop")
    (tmp_path / "bytes.txt").write_bytes(b"\xff\xfe\x00")
    if "LED" in words:
        record(Drive(world=plan, renderer=RendererKind.NONE, end=1.0), tmp_path / "led.mcap")
    named = {"KEYS": keys, "BAD": tmp_path / "bad.txt", "LED": tmp_path / "led.mcap", "BYTES": tmp_path / "bytes.txt"}
    path = tmp_path / "out" / "drive.mcap"
    laser = () if "--sensors" in words else LASER
    answer = refseq("record", plan, *(named.get(word, word) for word in words), *laser, "-o", path)
    assert answer.code == 2
    assert told in answer.err
    assert len(answer.err.strip().splitlines()) == 1
    assert not path.parent.exists()


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="there is no /proc, where nobody makes a file")
@pytest.mark.parametrize("words", [("record",), ("record", "--format", "rosbag2"), ("drive",)])
def test_a_place_that_takes_no_file_is_told_before_the_world_is_opened(
    plan: str, refseq: Refseq, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    monkeypatch.setattr("refseq_bench.scenarios.drives.record.open_bench", None)
    answer = refseq(*words, plan, *LASER, "-o", "/proc/x/drive.mcap")
    told = "error: /proc/x/drive.mcap: cannot be written: no write access to folder /proc\n"
    assert (answer.code, answer.out, answer.err) == (2, "", told)
