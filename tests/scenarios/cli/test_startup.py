"""Start-up of commands, by the packages that they import: each of these takes a twentieth of a second and more."""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from refseq_bench.scenarios.cli.app import NAMES, command_tree
from tests.support import corridor_drive

SLOW = {"cv2", "foxglove", "matplotlib", "mujoco", "networkx", "numpy", "pandas", "pyarrow", "ray", "rerun", "zenoh"}
SLOW |= {"aiohttp", "faiss", "gymnasium", "jinja2", "junitparser", "mcap", "optuna", "pebble", "rosbags", "torch"}
SLOW |= {"websockets"}
SLOW |= {f"scipy.{part}" for part in ("linalg", "ndimage", "optimize", "sparse", "spatial", "special", "stats")}
PROGRAM = """
import json, sys
from refseq_bench.scenarios.cli.app import exit_code
told = []
for words in json.loads(sys.argv[1]):
    exit_code(words)
    told.append(list(sys.modules))
print(json.dumps(told))
"""


def imported(folder: Path, *lines: str) -> dict[str, set[str]]:
    """Modules that one process has imported for each of these commands, one after another."""
    words = json.dumps([line.split() for line in lines])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, words], cwd=folder, capture_output=True, text=True, check=True
    )
    told = [set(modules) for modules in json.loads(done.stdout.splitlines()[-1])]
    return {line: now - before for line, before, now in zip(lines, [set(), *told], told, strict=False)}


def slow(found: dict[str, set[str]]) -> dict[str, set[str]]:
    """The slow packages among modules, by the command that imported them."""
    return {line: modules & SLOW for line, modules in found.items() if modules & SLOW}


def commands(tree: Any, *path: str) -> Iterator[str]:
    """All commands with the groups that they are in."""
    for name, command in tree.commands.items():
        yield from commands(command, *path, name) if hasattr(command, "commands") else [" ".join((*path, name))]


def test_no_help_imports_what_is_slow(tmp_path: Path) -> None:
    found = imported(tmp_path, "--help", *(f"{name} --help" for name in NAMES), "log info --help", "map merge --help")
    assert slow(found) == {}
    assert "refseq_bench.scenarios.cli.drives.localise" in found["localise --help"]


def test_no_command_imports_what_is_slow_to_refuse_an_option(tmp_path: Path) -> None:
    lines = [f"{command} --nonsense" for command in commands(command_tree(*NAMES))]
    assert slow(imported(tmp_path, "nonsense", *lines)) == {}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording of two views, and a map of it."""
    made = tmp_path_factory.mktemp("startup")
    views = corridor_drive(np.random.default_rng(1), count=2, size=48)
    with RecordingWriter(made / "drive.mcap", {"world": "made"}) as writer:
        for view in views:
            writer.write(view, view.truth)
    learn(views).save(made / "map.refseq")
    return made


ARRAYS = {"numpy"}
PICTURES = {*ARRAYS, "cv2"}
LOGS = {*PICTURES, "foxglove", "mcap", "rosbags"}
ROBOTS = {*PICTURES, "mujoco"}
DRIVES = {*ROBOTS, "foxglove"}
MAPS = {*PICTURES, "scipy.sparse", "scipy.special"}
CHEAP = (
    (
        (
            set(),
            "live none.refseq hallway --connect nowhere",
            "module control --address 192.0.2.1",
            "module viewer none.refseq --connect nowhere",
            "scenario template -o none.txt",
            "view none.mcap --connect nowhere",
        ),
        (
            ARRAYS,
            "compare drive.mcap drive.mcap --methods none",
            "localise map.refseq drive.mcap --stage none",
            "mission lamp none.lamp",
            "record hallway -o none.txt",
            "scenario curves nowhere -o none.svg",
            "scenario list",
            "scenario list smoke --json",
            "scenario list none",
            "scenario report nowhere",
            "scenario run none",
            "scenario search none --method vlad --budget 1",
            "scenario show none",
            "scenario tables none.md nowhere",
            "scenario validity nowhere",
            "serve map.refseq --stage none",
            "world draw none -o none.svg",
            "world generate none -o none.toml",
            "world list",
        ),
        (
            PICTURES,
            "drive hallway -o none.txt",
            "log check none.mcap",
            "log drift none.mcap",
            "log laser none.mcap",
            "mission look none.scene drive.mcap",
            "mission plan map.refseq [LD_XX]",
            "mission scene none.mcap --along 1 -o none.scene",
        ),
        (
            {*PICTURES, "foxglove"},
            "log convert none.mcap -o none.tum",
            "log layout none.mcap -o none.json",
        ),
        (
            LOGS,
            "log cut none.mcap -o cut.mcap --views 0:1",
            "log info drive.mcap",
            "log trim none.mcap -o cut.mcap",
        ),
    ),
    (
        (
            ROBOTS,
            "robot check none",
            "robot filmstrip none -o none.png",
            "robot list",
            "robot serve none",
            "robot show robuter",
            "robot try robuter none",
            "robot umbmark none",
            "scenario run smoke --methods none",
            "scenario run smoke --seeds none",
            "scenario show smoke --json",
            "world check none",
            "world lux none --at 1,1,1",
            "world show hallway",
        ),
        (
            DRIVES,
            "record none -o none.mcap",
            "world contact-sheet none -o none.png",
            "world day none -o none.png",
        ),
    ),
    (
        (
            MAPS,
            "demo --light none",
            "learn none.mcap -o none.refseq",
            "localise none.refseq drive.mcap",
            "map add none.refseq drive.mcap",
            "map channel none.refseq drive.mcap",
            "map compact none.refseq -o small.refseq",
            "map matrix map.refseq",
            "map merge none.refseq map.refseq -o none.refseq",
            "map paths none.refseq drive.mcap",
            "map plan map.refseq -o none.png",
            "map similarity none.refseq map.refseq",
            "mission page nowhere",
            "mission plan map.refseq",
            "mission run none.refseq",
            "module localiser none.refseq",
            "module mission none.refseq",
            "module robot none.refseq",
            "report none.refseq drive.mcap none.parquet -o none.html",
        ),
        (
            {*MAPS, "networkx"},
            "map route map.refseq map:0 map:1",
        ),
    ),
)
"""Packages that are needed for what costs little, such as a list or a name that there is not, and commands for it.

No more may be imported: who draws, drives, learns or shows imports it when all that is asked for can be read. Of groups
that stand together each needs all that those before it do, so that one process can be asked for all of them.
"""


@pytest.mark.parametrize("groups", CHEAP, ids=[first for (_, first, *_), *_ in CHEAP])
def test_a_command_imports_no_slow_package_that_it_does_not_use(
    folder: Path, groups: Sequence[tuple[set[str], *tuple[str, ...]]]
) -> None:
    found = slow(imported(folder, *(line for _, *lines in groups for line in lines)))
    before: set[str] = set()
    for needed, *lines in groups:
        assert before <= needed
        own = {line: found[line] for line in lines if line in found}
        assert {line: modules - needed for line, modules in own.items() if modules - needed} == {}
        before = before.union(*own.values())
        assert before == needed, "what none of them needs is not in the list"


def test_each_command_is_asked_for_something_cheap() -> None:
    """But the doctor, who looks at all packages."""
    asked = [line for groups in CHEAP for _, *lines in groups for line in lines]
    named = commands(command_tree(*NAMES))
    lacking = [name for name in named if not any(f"{line} ".startswith(f"{name} ") for line in asked)]
    assert lacking == ["doctor"]


@pytest.mark.parametrize("name", ["refseq_bench.scenarios.cli.app", "typer"])
def test_ctrl_c_during_the_imports_is_one_line(name: str) -> None:
    """Half of a command's start-up are imports: nobody who stops it there wants to see where."""
    program = f"""
import sys
class Stop:
    def find_spec(self, name, *others):
        if name == {name!r}:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Stop())
from refseq_bench.scenarios.cli.start import main
main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.quick_cases("log info drive.mcap --json")
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full, which is as full as a disk can be")
@pytest.mark.parametrize("line", ["--version", "world list", "log info drive.mcap --json"])
def test_output_that_nobody_can_take_is_one_line(folder: Path, line: str) -> None:
    """As where a program's --json goes to a disk that is full."""
    command = [sys.executable, "-c", "from refseq_bench.scenarios.cli.start import main; main()", *line.split()]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, cwd=folder, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    told = "error: the output, or a file, cannot be written: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, told)


START = [sys.executable, "-c", "from refseq_bench.scenarios.cli.start import main; main()"]


@pytest.mark.quick_cases(">&- 2>&-")
@pytest.mark.parametrize("closed", [">&-", ">&- 2>&-", "2>&-"])
def test_a_service_without_an_output_has_done_what_was_asked(folder: Path, closed: str) -> None:
    words = shlex.join([*START, "log", "info", "drive.mcap", "--json"])
    done = subprocess.run(["bash", "-c", f"{words} {closed}"], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_reader_who_has_gone_is_no_verdict(folder: Path) -> None:
    """1 would say that what was looked at is not as required."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as gone:
        done = subprocess.run(
            [*START, "log", "info", "drive.mcap"],
            cwd=folder,
            stdout=gone,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.parametrize(
    "line", ["log info f? -o n.mcap", "record hallway --name n? -o n.mcap", "learn drive.mcap -o m?"]
)
def test_a_name_that_is_no_utf_8_is_refused_before_any_work(folder: Path, line: str) -> None:
    before = set(folder.iterdir())
    words = [word.replace("?", os.fsdecode(b"\xff")) for word in line.split()]
    done = subprocess.run([*START, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert "\\udcff: is no UTF-8; valid are words and names that are" in done.stderr
    assert done.stderr.count("\n") == 1
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize("line", ["doctor", "world list"])
def test_a_folder_that_is_no_more_is_told(tmp_path: Path, line: str) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    words = f"cd {gone} && rmdir {gone} && {shlex.join(START)} {line}"
    done = subprocess.run(["bash", "-c", words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: the folder that this was typed in is no more; valid is one that is there: cd to it\n"
