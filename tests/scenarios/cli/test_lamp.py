"""``refseq mission lamp``: a LAMP program, run and drawn."""

from collections.abc import Callable
from pathlib import Path

import pytest

from refseq.missions.lamp import parse_lamp, print_lamp
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.scenarios.missions.lamp import read_program
from tests.refseq.missions.test_lamp import ELEVEN
from tests.scenarios.conftest import Answer, Refseq

Lamp = Callable[..., Answer]


@pytest.fixture
def lamp(refseq: Refseq, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Lamp:
    """Run a program, on a terminal that wraps no reason."""
    monkeypatch.setenv("COLUMNS", "120")

    def run(program: str, *words: str) -> Answer:
        path = tmp_path / "mine.lamp"
        path.write_text(program)
        return refseq("mission", "lamp", path, *words)

    return run


def test_the_library_s_program_is_the_thesis_s() -> None:
    assert (LIBRARY / "fig-1.6.lamp").read_text() == ELEVEN
    assert print_lamp(read_program(Path("fig-1.6.lamp"))) == ELEVEN
    assert read_program(Path("fig-1.6.lamp")) == parse_lamp(ELEVEN)


def test_a_program_that_finishes_is_told_stage_by_stage_and_drawn(lamp: Lamp, tmp_path: Path) -> None:
    code, said, _ = lamp("MOVE LV 300 DIL 500\nMOVE AV 20 ANL 30\n", "-o", str(tmp_path / "plan.svg"))
    assert code == 0
    assert said.count("finished") == 2
    assert "1. MOVE LV 300 DIL 500" in said
    drawn = (tmp_path / "plan.svg").read_text()
    assert "1. MOVE LV 300 DIL 500: finished" in drawn
    assert "2. MOVE AV 20 ANL 30: finished" in drawn


def test_a_stage_that_fails_is_told_and_none_after_it(lamp: Lamp) -> None:
    code, said, _ = lamp("MOVE AV 5 ANL 90\nMOVE AV 20 ANL 30\n", "--timeout", "2")
    assert code == 1
    assert "not done after 2 s" in said
    assert "ANL 30" not in said


@pytest.mark.parametrize(
    ("program", "words", "told"),
    [
        ("RUN", (), "mine.lamp: LAMP program, line 1, column 1: 'RUN' is no verb; valid are MOVP, "),
        ("CROSS", ("--robot", "segway_rmp"), "robot 'segway_rmp' has no sonars, "),
        ("CROSS", ("--timeout", "-1"), "LAMP: timeout = -1 s is not valid: valid is "),
        ("CROSS", ("--route", "up"), "unknown route 'up' in world 'lamp': valid are forward, reverse\n"),
        ("CROSS", ("-o", "no/plan.svg"), "no/plan.svg: cannot be written: there is no folder no\n"),
    ],
)
def test_what_is_wrong_is_one_line(lamp: Lamp, program: str, words: tuple[str, ...], told: str) -> None:
    answer = lamp(program, *words)
    assert answer.code == 2
    assert told in answer.err
    assert answer.err.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("nowhere.lamp", r"^.*nowhere\.lamp: cannot be read: No such file or directory; valid is "),
        ("mine.txt", r"^.*mine\.txt: is no LAMP program; valid is a file ending in \.lamp, such as fig-1\.6\.lamp$"),
    ],
)
def test_a_file_that_is_none_is_told(tmp_path: Path, name: str, told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        read_program(tmp_path / name)
