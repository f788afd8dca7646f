"""Each attack in its short form; and the table, which does not stop at a fall nor hide one."""

import json
import shutil
import signal
import sys
from pathlib import Path
from unittest import SkipTest

import pytest

from tests.robustness import __main__ as command_line
from tests.robustness.attack import Attack, AttackFunction, Attempt, attacks
from tests.robustness.run import run
from tests.robustness.table import as_json, command, markdown, read_rows

ATTACKS = attacks()


@pytest.mark.slow_cases(
    "crowd", "full-record", "guest-floods", "kill-learn", "kill-record", "map-bomb", "orphans", "stalled-viewer"
)
@pytest.mark.parametrize("name", ATTACKS)
def test_survives(name, tmp_path):
    row = run(ATTACKS[name], ATTACKS[name].short, 0, tmp_path)
    if row.skipped:
        pytest.skip(row.skipped)
    assert [(fall.seed, fall.told) for fall in row.falls] == []


@pytest.mark.parametrize("one", ATTACKS.values(), ids=list(ATTACKS))
def test_says_in_a_sentence_what_is_promised(one):
    assert not one.promise[0].islower()
    assert "\n" not in one.promise
    assert not one.promise.endswith(".")
    assert one.tries >= max(one.short, 1)
    assert one.short >= 0


def made_up(function: AttackFunction, limit: float = 10.0) -> Attack:
    return Attack("made-up", "tests", "Nothing falls", 4, 1, function, limit)


def falls_at_two(seed: int, folder: Path) -> Attempt:
    (folder / "input").write_text(str(seed))
    return Attempt("it is two\nor so" if seed == 2 else None, {"s of CPU": float(seed % 3)})


def no_root(seed: int, folder: Path) -> None:
    raise SkipTest("no root for a tmpfs")


def test_goes_on_after_a_fall_and_keeps_its_input_alone(tmp_path):
    row = run(made_up(falls_at_two), 4, 0, tmp_path)
    assert (row.tries, row.survived, row.figures) == (4, 3, {"s of CPU": 2.0})
    assert [(fall.seed, fall.told) for fall in row.falls] == [(2, "it is two or so")]
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("input")] == [Path("made-up/2/input")]


def test_an_exception_is_a_fall_with_its_traceback(tmp_path):
    (fall,) = run(made_up(lambda seed, folder: str(1 // seed)), 1, 0, tmp_path).falls
    assert fall.told.startswith("ZeroDivisionError")
    assert "1 // seed" in Path(fall.kept, "traceback.txt").read_text()


def test_a_try_without_end_is_a_fall(tmp_path):
    (fall,) = run(made_up(lambda seed, folder: signal.pause(), limit=0.05), 1, 0, tmp_path).falls
    assert fall.told == "TimeoutError: not done after 0.05 s"


def test_an_attack_that_cannot_run_here_is_in_the_table_with_its_reason(tmp_path):
    row = run(made_up(no_root), 4, 0, tmp_path)
    assert row.falls == []
    assert "| made-up | Nothing falls | 0 | skipped | no root for a tmpfs |" in markdown([row])


def test_the_table_has_the_command_that_repeats_a_row(tmp_path):
    commands = [command(run(made_up(falls_at_two), tries, seed, tmp_path)) for tries, seed in ((4, 0), (1, 2))]
    assert commands == ["./run attacks made-up", "./run attacks made-up --tries 1 --seed 2"]


def test_rows_are_read_from_the_file_as_they_were_written(tmp_path):
    row = run(made_up(falls_at_two), 4, 0, tmp_path)
    (tmp_path / "rows.json").write_text(json.dumps(as_json([row])))
    assert read_rows(tmp_path / "rows.json") == [row]


@pytest.fixture
def only_made_up(monkeypatch):
    monkeypatch.setattr(command_line, "attacks", lambda: {"made-up": made_up(falls_at_two)})


def test_a_fall_ends_the_command_with_one(only_made_up, tmp_path, capsys):
    words = ["--kept", str(tmp_path), "--markdown", str(tmp_path / "table.md")]
    assert command_line.main([*words, "--short"]) == 0
    assert command_line.main([*words, "made-up"]) == 1
    told = capsys.readouterr()
    assert told.err.startswith("made-up fell with seed 2: it is two or so")
    assert "./run attacks made-up" in told.out
    assert "- `made-up`, seed 2: it is two or so" in (tmp_path / "table.md").read_text()


def test_an_unknown_attack_is_named_with_the_valid_ones(only_made_up, capsys):
    assert command_line.main(["fuzz"]) == 2
    assert capsys.readouterr().err == "unknown attack 'fuzz'; valid: tests, made-up\n"


def test_no_tries_are_refused(only_made_up, capsys):
    assert command_line.main(["--tries", "0"]) == 2
    assert capsys.readouterr().err == "--tries 0 is not valid; valid is 1 or more\n"


def test_an_attack_that_dies_does_not_take_the_others_with_it(monkeypatch, tmp_path, capsys):
    every = {"made-up": made_up(no_root), "other": made_up(no_root)}
    monkeypatch.setattr(command_line, "attacks", lambda: every)
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    monkeypatch.setattr(command_line, "print_table", lambda rows: None)
    assert command_line.main(["--kept", str(tmp_path), "--json", str(tmp_path / "rows.json")]) == 1
    assert [row.falls[0].told for row in read_rows(tmp_path / "rows.json")] == [
        "the attack's own process ended with code 1"
    ] * 2
