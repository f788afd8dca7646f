"""The commands about robots as a user meets them."""

import math
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from refseq_bench import robots
from refseq_bench.scenarios.robot_checks.body import Body
from refseq_bench.scenarios.robot_checks.check import Finding
from refseq_bench.scenarios.robot_checks.sources import SOURCED, RobotMeasure, measures
from tests.scenarios.conftest import Answer, Refseq
from tests.terminals import needs_terminals
from tests.worlds.conftest import SMALL

PAGE = Path(__file__).resolve().parents[3] / "docs" / "robots.md"
ROBOTS = ("robuter", "segway_rmp")
SLOW = Finding("speed", 3.0, "×", low=20.0, judged=False)

Command = Callable[[str], Answer]


@pytest.fixture
def command(refseq: Refseq, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Command:
    """Run a command about robots, in a folder with one plan and a terminal of 80 characters."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "small.toml").write_text(SMALL.format(top="", end=""))
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    return lambda words: refseq("robot", *words.split())


@pytest.fixture(scope="module", params=ROBOTS)
def body(request: pytest.FixtureRequest) -> Body:
    return Body(robots.load(request.param))


# --- the figures ---


def test_inertia_is_that_of_the_models_own_mass_matrix(body: Body) -> None:
    mass_matrix = np.zeros((body.model.nv, body.model.nv))
    mujoco.mj_fullM(body.model, body.data, mass_matrix)
    # The free joint's last three rows turn the whole about the base's own origin.
    about_origin = mass_matrix[3:6, 3:6]
    arm = body.centre - body.data.body(body.robot.base).xpos
    steiner = body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    np.testing.assert_allclose(body.inertia, about_origin - steiner, atol=0.02 * about_origin.max())
    assert mass_matrix[0, 0] == pytest.approx(body.mass)


def test_the_wheels_are_those_of_the_drive(body: Body) -> None:
    assert body.track == pytest.approx(body.robot.drive.track)
    assert body.wheel.size[2] == pytest.approx(2 * body.robot.drive.wheel_radius)
    assert body.hubs[0, 2] == pytest.approx(body.robot.drive.wheel_radius, abs=1e-3)


def test_the_model_has_the_sizes_that_sources_give(body: Body) -> None:
    ours = measures(body)
    for measure, sourced in SOURCED[body.robot.name].items():
        # The Robuter's front bumper stands before the laser, 4 cm farther ahead than the sources' overall length.
        within = 0.05 if measure is RobotMeasure.LENGTH else 0.01
        assert ours[measure] == pytest.approx(sourced.value, rel=within), measure


def test_what_it_sees_with_is_no_part_of_the_vehicle(body: Body) -> None:
    mast = body.whole.high[2]
    assert mast == pytest.approx(body.robot.shape.height)
    assert body.vehicle.high[2] < mast - 0.3
    assert measures(body)[RobotMeasure.HEIGHT] == pytest.approx(body.vehicle.high[2], abs=1e-3)


# --- list and show ---


def test_list_names_every_robot_on_80_characters(command: Command) -> None:
    answer = command("list")
    assert answer.code == 0
    for name in robots.names():
        assert re.search(rf"^ ?{re.escape(name)} ", answer.out, re.MULTILINE), name
    assert "154.0" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


def test_show_tells_the_models_figures(command: Command) -> None:
    answer = command("show robuter")
    assert answer.code == 0
    for said in ("154.0 kg", "radius 0.120 m, track 0.620 m, 4.07 kg each", "8024 pulses", "24, ", "front, rear"):
        assert said in answer.out
    assert re.search(r"height +C +0.748 +0.748 +3.117 +3.117 +\+0.0 %", answer.out)
    assert max(map(len, answer.out.splitlines())) <= 80


def test_show_draws_a_picture_that_is_neither_dark_nor_empty(command: Command, tmp_path: Path) -> None:
    assert command("show segway_rmp -o picture.png --renderer classic").code == 0
    picture = cv2.imread(str(tmp_path / "picture.png"), cv2.IMREAD_GRAYSCALE)
    still = picture[220:500, 900:1350]
    assert 60 < still.mean() < 220
    assert still.std() > 10
    assert (picture < 200).mean() > 0.05


# --- strip ---


def test_a_strip_ends_with_the_route(command: Command, tmp_path: Path) -> None:
    answer = command("filmstrip robuter --world small.toml --seconds 40 --frames 9 --renderer classic -o strip.png")
    assert answer.code == 0
    frames, seconds = map(int, re.search(r"(\d+) frames of (\d+) s", answer.out).groups())
    assert frames < 9
    assert 6 / 0.5 < seconds <= 30
    assert (tmp_path / "strip.png").stat().st_size > 10_000


# --- drive ---


def test_behaviours_run_one_after_another(command: Command, tmp_path: Path) -> None:
    answer = command("try robuter MN:1 MT:90 --world small.toml -o plan.svg")
    assert answer.code == 0
    assert len(re.findall(r"\bfinished\b", answer.out)) == 2
    assert "went on for" in answer.out
    assert "MT:90: finished" in (tmp_path / "plan.svg").read_text()


def test_one_that_fails_ends_the_drive_with_1(command: Command) -> None:
    answer = command("try robuter MA:0,3 MT:90 --world small.toml --pose 4,0,0 --timeout 30")
    assert answer.code == 1
    assert "failed" in answer.out
    assert "MT:90" not in answer.out


# --- check, umbmark ---


@pytest.mark.parametrize(("measured", "code", "verdict"), [(0.5, 0, "good"), (1.5, 1, "BAD"), (math.nan, 1, "BAD")])
def test_check_ends_with_1_where_something_is_not_as_it_should(
    command: Command, monkeypatch: pytest.MonkeyPatch, measured: float, code: int, verdict: str
) -> None:
    found = [Finding("first", 0.0, "m", high=1.0), Finding("second", measured, "m", high=1.0)]
    monkeypatch.setattr("refseq_bench.scenarios.robot_checks.check.findings", lambda name: iter(found))
    answer = command("check robuter")
    assert answer.code == code
    assert re.search(rf"second .* at most 1 +m +{verdict}", answer.out)


def test_check_does_not_judge_how_fast_a_busy_machine_simulates(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("refseq_bench.scenarios.robot_checks.check.findings", lambda name: iter([SLOW]))
    answer = command("check robuter")
    assert answer.code == 0
    assert re.search(r"speed .* 3.000 +at least 20 +× +not judged", answer.out)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_robots_do_what_they_should(command: Command, name: str) -> None:
    answer = command(f"check {name}")
    assert answer.code == 0, answer.out


@pytest.mark.slow
def test_umbmark_tells_its_figures_and_draws_them(command: Command, tmp_path: Path) -> None:
    answer = command("umbmark robuter --runs 1 --side 0.5 -o squares.png")
    assert answer.code == 0
    assert "E max,syst" in answer.out
    assert (tmp_path / "squares.png").stat().st_size > 5_000


# --- serve ---


def served(folder: Path, *words: str) -> "subprocess.Popen[str]":
    # Python, not a shell, starts it: the signal then reaches the process that it is meant for.
    code = "from refseq_bench.scenarios.cli.app import main; main()"
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", code, "robot", "serve", "robuter", "--world", "small.toml", *words]
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True)


def test_a_program_outside_drives_it_and_ctrl_c_ends_it(command: Command, tmp_path: Path) -> None:
    with served(tmp_path, "--tcp", "0") as server:
        address = re.search(r"127\.0\.0\.1:(\d+)", server.stdout.readline())
        with socket.create_connection(("127.0.0.1", int(address[1])), timeout=20) as line:
            line.sendall(b"AM 100 100\n")
            assert line.makefile("rb").readline() == b"ack\n"
        server.send_signal(signal.SIGINT)
        _, said = server.communicate(timeout=20)
    assert server.returncode == 130
    assert said.strip() == "interrupted"


@pytest.mark.slow
def test_the_program_of_the_page_drives_a_metre(
    command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (program,) = re.findall(r"```python\n(import socket\n.*?)```", PAGE.read_text(), re.DOTALL)
    with served(tmp_path, "--tcp", "0", "--rate", "2", "--seconds", "60") as server:
        port = re.search(r"127\.0\.0\.1:(\d+)", server.stdout.readline())[1]
        exec(program.replace("7777", port), {})
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=20)
    told = capsys.readouterr().out
    _, _, left, right, *_ = re.findall(r"'(.*?)'", told)
    for counter in (left, right):
        assert 0.99 < 94.0e-6 * int(counter) < 1.5, told  # late where the machine is busy


@needs_terminals
def test_serving_ends_after_its_time(command: Command) -> None:
    answer = command("serve robuter --world small.toml --pty --seconds 0.2")
    assert answer.code == 0
    assert re.search(r"listens at /dev/\S+;", answer.out)


# --- what is wrong ---


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("show scout", "unknown robot 'scout': valid are robuter, segway_rmp"),
        ("check robuter scout", "unknown robot 'scout': valid are"),
        ("show robuter -o picture.jpg", "picture.jpg: is no name of a picture; valid is one that ends in .svg or .png"),
        ("show robuter -o nowhere/a.png", "nowhere/a.png: cannot be written: there is no folder nowhere"),
        ("show robuter -o folder", "folder: is a folder; valid is the name of a file to write"),
        ("show robuter -o folder.png", "folder.png"),
        ("filmstrip robuter --world atlantis -o a.png", "atlantis"),
        ("filmstrip robuter --world small.toml --route up -o a.png", "unknown route 'up' in world 'small'"),
        ("filmstrip robuter --seconds 0 -o a.png", "seconds 0 is not valid; it should be a time above 0"),
        ("filmstrip robuter --seconds nan -o a.png", "seconds nan is not valid"),
        ("filmstrip robuter --frames 1 -o a.png", "frames 1 is not valid; it should be 2 or more"),
        ("filmstrip robuter --speed -1 -o a.png", "speed -1 is not valid; it should be above 0 m/s"),
        ("try robuter XX", "unknown behaviour 'XX'"),
        ("try robuter MT:ninety", "MT:ninety"),
        ("try robuter MN:1 --pose 3,0", "pose '3,0' is not valid; it should be X,Y,DEGREES"),
        ("try robuter MN:1 --pose 3,0,nan", "pose '3,0,nan' is not valid"),
        ("try robuter MN:1 --pose 3,0,0 --route forward", "--pose and --route exclude each other"),
        ("try robuter MN:1 --world small.toml --pose 30,0,0", "pose 30,0,0 lies outside 'small'"),
        (
            "try robuter MN:1 --world small.toml --pose 4,1.1,0",
            "pose 4,1.1,0 is no place for robuter: it stands in wall '",
        ),
        ("try robuter MN:1 --world small.toml --timeout 0", "timeout 0 is not valid"),
        ("try robuter MA:nan,0", "behaviour 'MA:nan,0': x 'nan': valid is a number from -1000 to 1000 m"),
        ("try robuter MC:up", "behaviour 'MC:up': side 'up': valid are ahead, left, right"),
        ("try robuter MW:left,0.1 --world small.toml", "distance 0.1 m to a wall"),
        ("umbmark robuter --side 0", "side = 0.0 m must be above 0"),
        ("umbmark robuter --side nan", "side = nan m must be above 0"),
        ("umbmark robuter --runs 0", "runs = 0 must be 1 or more"),
        ("serve segway_rmp --world small.toml", "robot 'segway_rmp' has no serial line: valid is robuter"),
        ("serve robuter --world small.toml --tcp 70000", "TCP port 70000 does not exist"),
        ("serve robuter --world small.toml --tcp 1 --pty", "--tcp and --pty exclude each other"),
        (
            "serve robuter --world small.toml --rate 0",
            "rate 0 is not valid; it should be simulated over real",
        ),
        ("serve robuter --world small.toml --seconds -3", "seconds -3 is not valid"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(command: Command, tmp_path: Path, words: str, said: str) -> None:
    before = sorted(path.name for path in tmp_path.rglob("*"))
    answer = command(words)
    assert answer.code == 2
    assert said in answer.err
    assert answer.err.startswith("error: ")
    assert answer.err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.rglob("*")) == before


def test_a_picture_that_fails_leaves_the_old_one(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "old.png").write_bytes(b"old")

    def fail(_: object, path: Path, **__: object) -> None:
        path.write_bytes(b"half")
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", fail)
    answer = command("show robuter --renderer classic -o old.png")
    assert answer.code == 2
    assert answer.err == "error: old.png: cannot be written: No space left on device\n"
    assert (tmp_path / "old.png").read_bytes() == b"old"
    assert {path.name for path in tmp_path.iterdir()} == {"old.png", "small.toml", "folder", "folder.png"}
