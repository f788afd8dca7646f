"""Recording a drive by behaviours: from the command line, with the words in the recording, and bad words refused."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from refseq.logs import read_recording
from refseq.map.learning import learn
from refseq.map.paths.led import led_behaviours
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.faults import Kidnap
from refseq_bench.sim.drives.operator import OperatorStyle, style_named
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import StuckError
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.scenarios.conftest import Refseq
from tests.worlds.conftest import SMALL

WORDS = ("MN:2", "MT:180", "MN:1")


@pytest.fixture
def plan(tmp_path: Path) -> str:
    """Path of a short corridor's plan."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL.format(top="", end=""))
    return str(path)


@pytest.fixture
def drive(plan: str) -> Drive:
    return Drive(world=plan, renderer=RendererKind.NONE, trigger=Trigger(distance=0.4), behaviours=WORDS)


def test_a_drive_by_behaviours_tells_of_them(drive: Drive, tmp_path: Path) -> None:
    path = tmp_path / "out" / "drive.mcap"
    heard: list[tuple[float, float | None, int]] = []
    recording = record(drive, path, lambda *told: heard.append(told))
    read = read_recording(path)
    assert [view.behaviour for view in read.views] == [view.behaviour for view in recording.views]
    assert tuple(view.behaviour for view in read.views if view.behaviour) == WORDS
    assert json.loads(read.metadata["behaviours"]) == list(WORDS)
    assert len(heard) == len(read.views)
    assert {length for _, length, _ in heard} == {None}, "nobody knows how far they will lead"
    assert learn(read.views).paths[0].annotations.behaviours == tuple(view.behaviour for view in read.views)
    led = record(replace(drive, behaviours=()), tmp_path / "led.mcap")
    assert {view.behaviour for view in led.views} == {""}
    assert "behaviours" not in led.metadata
    assert learn(led.views).paths[0].annotations.behaviours == led_behaviours(led.views)


@pytest.mark.slow
def test_the_same_seed_is_the_same_drive(drive: Drive, tmp_path: Path) -> None:
    one, same, other = (
        record(replace(drive, seed=seed), tmp_path / f"{number}.mcap").views for number, seed in enumerate((1, 1, 2))
    )
    assert [view.truth for view in one] == [view.truth for view in same]
    assert [view.truth for view in one] != [view.truth for view in other]


def test_what_was_seen_until_a_behaviour_failed_is_kept(drive: Drive, tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    with pytest.raises(StuckError, match=r"^behaviour 2, MC, failed after 1\.\d m: waited 10 s: no door ahead"):
        record(replace(drive, behaviours=("MN:1", "MC")), path)
    assert [view.behaviour for view in read_recording(tmp_path / "drive.partial.mcap").views if view.behaviour] == [
        "MN:1",
        "MC",
    ]


def test_a_robot_that_is_stuck_is_no_bad_input_and_tells_where_its_views_lie(
    plan: str, tmp_path: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = refseq("record", plan, "--renderer", "none", "--behaviours", "MN:1 MC", "-o", "drive.mcap")
    assert (answer.code, answer.err.count("\n")) == (1, 1)
    assert answer.err.startswith("behaviour 2, MC, failed after 1.")
    assert "; drive.partial.mcap holds 3 views, incomplete" in answer.err


def test_faults_are_for_drives_that_are_led(drive: Drive) -> None:
    with pytest.raises(ScenarioError, match=r"^faults and behaviours exclude each other"):
        replace(drive, faults=(Kidnap(at=1.0, to=2.0),))


@pytest.mark.parametrize("style", [replace(style_named("weaving"), side=0.0), OperatorStyle(side=0.3)])
def test_nobody_who_leads_has_a_style_beside_behaviours(drive: Drive, style: OperatorStyle) -> None:
    with pytest.raises(ScenarioError, match=r"^an operator's style or side and behaviours exclude each other"):
        replace(drive, style=style)
    assert replace(drive, style=OperatorStyle(strength=0.0)).behaviours == WORDS


def test_from_the_command_line(plan: str, tmp_path: Path, refseq: Refseq) -> None:
    path = tmp_path / "drive.mcap"
    answer = refseq("record", plan, "--renderer", "none", "--behaviours", " MN:1  MT:90 ", "-o", path)
    assert answer.code == 0, answer.err
    assert [view.behaviour for view in read_recording(path).views if view.behaviour] == [
        "MN:1",
        "MT:90",
    ]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("MN:1 fly", "unknown behaviour 'fly': valid are "),
        ("MN:1 MN", "behaviour 'MN': 0 values: valid is MN:length[,left][,right][,aside][,turn], such as MN:2.5,0.9"),
        ("MT:1000", "behaviour 'MT:1000': angle '1000': valid is a number from -360 to 360 degrees, but not 0"),
        ("MN:1,MT:90", "behaviour 'MN:1,MT:90': left 'MT:90': valid is a number from 0 to 2.5 m"),
        ("MN:1 MW:left,0.11", "behaviour 'MW:left,0.11': distance 0.11 m to a wall: valid is "),
    ],
)
def test_bad_words_are_refused(plan: str, tmp_path: Path, refseq: Refseq, words: str, told: str) -> None:
    path = tmp_path / "new" / "drive.mcap"
    answer = refseq("record", plan, "--renderer", "none", "--behaviours", words, "-o", path)
    assert answer.code == 2
    assert answer.err.startswith(f"error: {told}")
    assert answer.err.count("\n") == 1
    assert not path.parent.exists(), "nothing is written"
