"""Mistakes in commands and options, old spellings among them: one line each; options that mean one thing."""

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from typer.core import TyperGroup

from refseq_bench.scenarios.cli.app import NAMES, command_tree
from refseq_bench.scenarios.cli.terminal.usage import RENAMED_COMMANDS, RENAMED_OPTIONS
from tests.scenarios.conftest import Refseq

SEVERAL_MEANINGS = {"--output": {"FILE", "FOLDER"}, "--at": {"X,Y,Z", "PLACE=X,Y"}}
"""Placeholders of options that have more than one."""


def commands(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """All commands with their names, groups among them."""
    for name, command in group.commands.items():
        yield " ".join((*path, name)), command
        if isinstance(command, TyperGroup):
            yield from commands(command, (*path, name))


COMMANDS = dict(commands(command_tree(*NAMES)))
RECORD = "record hallway -o new.mcap"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("recrod hallway", "command 'recrod' is unknown; the nearest is 'record'"),
        ("world paint", "command 'world paint' is unknown; valid are list, show, check, draw, contact-sheet, lux, "),
        (
            "demo -o --help",
            "--output FOLDER: '--help' is an option, not the name that is missing; a file of that name is ./--help",
        ),
        ("learn drive.mcap -o --thin", "--output FILE: '--thin' is an option, not the name that is missing; a file of"),
        ("learn -o new.refseq -- --thin", "--thin: cannot be read: No such file or directory"),
        (f"{RECORD} --sed 2", "option '--sed' of 'refseq record' is unknown; the nearest is '--seed'"),
        (f"{RECORD} --end 0", "option '--end' of 'refseq record' is unknown; valid are --"),
        ("robot list --wings", "option '--wings' of 'refseq robot list' is unknown; valid are --json, --help"),
        ("--wings", "option '--wings' is unknown; valid are --version, --help"),
        ("record hallway", "--output FILE of 'refseq record' is missing: Recording to write (.mcap)"),
        ("learn -o x.refseq", "RECORDING of 'refseq learn' is missing: First drive: MCAP, a ROS bag, a CARMEN log"),
        (f"{RECORD} --seed x", "--seed 'x' is not valid; valid is a whole number of 0 or more [N]"),
        (f"{RECORD} --seed -1", "--seed '-1' is not valid; valid is a whole number of 0 or more [N]"),
        (f"{RECORD} --distance far", "--distance 'far' is not valid; valid is a number [METRES]"),
        (f"{RECORD} --turn 0.2", "--turn '0.2' is not valid; valid is a number from 1 to 360 [DEGREES]"),
        (f"{RECORD} --renderer gl", "--renderer 'gl' is not valid; valid are baked, filament, classic, none"),
        ("learn a.mcap -o b.refseq --thin -1", "--thin '-1' is not valid; valid is a number of 0 or more [METRES]"),
        ("learn a.mcap -o b.refseq --thin nan", "--thin 'nan' is not valid; valid is a number of 0 or more [METRES]"),
        ("localise a b --at-least 101", "--at-least '101' is not valid; valid is a number from 0 to 100 [PERCENT]"),
        ("localise a b --at-least nan", "--at-least 'nan' is not valid; valid is a number from 0 to 100 [PERCENT]"),
        ("demo --runs 0", "--runs '0' is not valid; valid is a whole number of 1 or more [N]"),
        ("map matrix a --top -1", "--top '-1' is not valid; valid is a whole number of 0 or more [N]"),
        ("compare", "REFERENCE QUERY of 'refseq compare' is missing: Pairs of drives, those in the same lights pooled"),
        ("world lux hallway", "--at X,Y,Z of 'refseq world lux' is missing: Point to measure at [m]"),
        (
            "world check",
            "WORLD of 'refseq world check' is missing: World of the library, corridor:SEED, building:SEED, both with "
            "dials, or floor plan (.toml)",
        ),
        (f"{RECORD} annex", "'refseq record' takes no 'annex'; 'refseq record --help' tells more"),
        ("record hallway -o", "option '-o' requires an argument"),
        ("doctor --json=yes", "option '--json' does not take a value"),
        ("record hallway -o a.mcap --name b", "--name goes with --script; valid is to lead the robot by a script"),
        ("view a.mcap -o a.rrd --layers b", "--output and --layers exclude each other; valid is one of them, or none"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(
    refseq: Refseq, tmp_path: Any, monkeypatch: pytest.MonkeyPatch, line: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = refseq(*line.split())
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {said}")
    assert answer.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("old", RENAMED_COMMANDS)
def test_an_old_command_is_refused_with_the_new_one(refseq: Refseq, old: str) -> None:
    answer = refseq(*old.split(), "x")
    new = RENAMED_COMMANDS[old]
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == f"error: 'refseq {old}' is called 'refseq {new}' now\n"
    assert any(new == name or new.startswith(f"{name} ") for name in COMMANDS)


@pytest.mark.parametrize("old", RENAMED_OPTIONS)
def test_an_old_option_is_refused_with_the_new_one(refseq: Refseq, old: str) -> None:
    command, _, option = old.rpartition(" ")
    answer = refseq(*command.split(), option, "1")
    new = RENAMED_OPTIONS[old]
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == f"error: {option} of 'refseq {command}' is called {new!r} now\n"
    words = [word for word in new.split() if not word.isupper()]
    where = command if new.startswith("-") else words[0]
    known = {spelling for parameter in COMMANDS[where].params for spelling in parameter.opts}
    assert {word for word in words if word.startswith("-")} <= known
    assert option not in {spelling for parameter in COMMANDS[command].params for spelling in parameter.opts}


def test_an_option_means_one_thing_in_the_whole_program() -> None:
    meanings: dict[str, set[str]] = {}
    for name, command in COMMANDS.items():
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert parameter.help, f"{name} {parameter.opts}"
                assert parameter.metavar is not None, f"{name} {parameter.opts}"
                meanings.setdefault(parameter.opts[0], set()).add(parameter.metavar)
    assert {name: units for name, units in meanings.items() if len(units) > 1} == SEVERAL_MEANINGS


def test_what_a_program_would_read_on_is_json(refseq: Refseq) -> None:
    for line in ("world list", "world show hallway", "robot list", "robot show robuter", "scenario list smoke"):
        answer = refseq(*line.split(), "--json")
        assert (answer.code, answer.err) == (0, "")
        assert json.loads(answer.out)
    checks = json.loads(refseq("doctor", "--json").out)
    assert {"name", "found", "ok", "cost", "remedy"} <= set(checks[0])


def imported(line: str) -> set[str]:
    """The modules that a command line imports in a process of its own."""
    code = (
        "import sys; from refseq_bench.scenarios.cli.app import exit_code; code = exit_code(sys.argv[1:]); "
        "print(*sys.modules, file=sys.stderr)"
    )
    told = subprocess.run([sys.executable, "-c", code, *line.split()], capture_output=True, text=True, check=True)
    return set(told.stderr.splitlines()[-1].split())


HEAVY = {"numpy", "scipy", "cv2", "mujoco", "rerun", "matplotlib", "pyarrow", "networkx", "faiss"}


@pytest.mark.parametrize(
    ("line", "more"),
    [("--help", {"pydantic", "importlib.metadata"}), ("record --help", set()), ("map merge --help", set())],
)
def test_help_loads_nothing_that_a_command_needs(line: str, more: set[str]) -> None:
    """So that it comes at once, and `refseq doctor` answers where packages are missing."""
    assert not (HEAVY | more) & imported(line)


def test_only_the_module_of_the_command_that_is_asked_for_is_imported() -> None:
    ours = "refseq_bench.scenarios.cli."
    assert {name for name in imported("--help") if name.startswith(ours)} <= {
        f"{ours}{name}" for name in ("app", "terminal", "terminal.console", "terminal.options", "terminal.usage")
    }
    assert f"{ours}record" not in imported("world --help")


def test_the_help_of_all_says_of_each_command_what_its_own_help_says() -> None:
    told, own = command_tree().commands, command_tree(*NAMES).commands
    assert tuple(told) == NAMES
    assert own.keys() == told.keys()
    for name in NAMES:
        first, _, _ = (own[name].help or "").partition("\n\n")
        assert told[name].help == " ".join(first.split())
        assert told[name].rich_help_panel == own[name].rich_help_panel


def takes_paths(command: Any) -> list[Any]:
    """Parameters of a command that name files or folders, by their placeholders."""
    words = ("FILE", "FOLDER", "LOG", "MAP", "MAPS", "QUERY", "RECORDING", "DRIVE", "REFERENCE QUERY", "OUT", "BELIEFS")
    return [one for one in command.params if one.metavar in words]


@pytest.mark.parametrize("name", [name for name, command in COMMANDS.items() if takes_paths(command)])
def test_an_empty_word_is_no_path(name: str, refseq: Refseq) -> None:
    """A variable of the shell that is not set; as a path it would be the folder that one is in."""
    for parameter in takes_paths(COMMANDS[name]):
        option = parameter.param_type_name == "option"
        arguments = [one for one in COMMANDS[name].params if one.param_type_name == "argument"]
        before = [parameter.opts[0]] if option else ["x"] * arguments.index(parameter)
        said = refseq(*name.split(), *before, "")
        spelling = f"{parameter.opts[0]} {parameter.metavar}" if option else parameter.metavar
        assert said.code == 2
        assert said.err.startswith(f"error: {spelling}: '' is no name; valid is that of a file or folder"), said.err
        assert said.err.count("\n") == 1
