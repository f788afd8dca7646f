"""The command that runs a LAMP program, as a user meets it; it is a function that `refseq mission` takes in."""

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from refseq.missions.lamp import parse_lamp, print_lamp
from refseq.missions.language import MissionError
from scenarios.cli.console import out
from scenarios.cli.lamp import lamp
from scenarios.errors import ScenarioError
from scenarios.library import LIBRARY
from scenarios.missions.lamp import read_program
from sim.errors import SimError
from tests.refseq.missions.test_lamp import ELEVEN

APP = typer.Typer()
APP.command()(lamp)


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal that wraps no reason, whoever has used it before."""
    monkeypatch.setattr(out, "width", 120)


def answer(folder: Path, program: str, *words: str) -> tuple[int, str]:
    """Exit code and what was said of a program; what is wrong is raised, as the command line tells it."""
    path = folder / "mine.lamp"
    path.write_text(program)
    result = CliRunner().invoke(APP, [str(path), *words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output


def test_the_library_s_program_is_the_thesis_s() -> None:
    assert (LIBRARY / "fig-1.6.lamp").read_text() == ELEVEN
    assert print_lamp(read_program(Path("fig-1.6.lamp"))) == ELEVEN
    assert read_program(Path("fig-1.6.lamp")) == parse_lamp(ELEVEN)


def test_a_program_that_finishes_is_told_stage_by_stage_and_drawn(tmp_path: Path) -> None:
    code, said = answer(tmp_path, "MOVE LV 300 DIL 500\nMOVE AV 20 ANL 30\n", "-o", str(tmp_path / "plan.svg"))
    assert code == 0
    assert said.count("finished") == 2
    assert "1. MOVE LV 300 DIL 500" in said
    drawn = (tmp_path / "plan.svg").read_text()
    assert "1. MOVE LV 300 DIL 500: finished" in drawn
    assert "2. MOVE AV 20 ANL 30: finished" in drawn


def test_a_stage_that_fails_is_told_and_none_after_it(tmp_path: Path) -> None:
    code, said = answer(tmp_path, "MOVE AV 5 ANL 90\nMOVE AV 20 ANL 30\n", "--timeout", "2")
    assert code == 1
    assert "not done after 2 s" in said
    assert "ANL 30" not in said


@pytest.mark.parametrize(
    ("program", "words", "error", "told"),
    [
        ("RUN", (), MissionError, r"mine\.lamp: LAMP program, line 1, column 1: 'RUN' is no verb; valid are MOVP, "),
        ("CROSS", ("--robot", "segway_rmp"), SimError, r"^robot 'segway_rmp' has no sonars, .* valid is "),
        ("CROSS", ("--timeout", "-1"), SimError, r"^LAMP: timeout = -1 s is not valid: valid is "),
        ("CROSS", ("--route", "up"), SimError, r"^unknown route 'up' in world 'lamp': valid are forward, reverse$"),
        ("CROSS", ("-o", "no/plan.svg"), ScenarioError, r"^no/plan\.svg: cannot be written: there is no folder no$"),
    ],
)
def test_what_is_wrong_is_one_line(
    tmp_path: Path, program: str, words: tuple[str, ...], error: type[Exception], told: str
) -> None:
    with pytest.raises(error, match=told) as caught:
        answer(tmp_path, program, *words)
    assert "\n" not in str(caught.value)


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
