"""The house rules that no linter knows: what is tracked, what is locked, what is documented, and how `run` behaves."""

import ast
import itertools
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import indent

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
LINKED = {"sim", "worlds", "robots", "scenarios"}
"""Rooms that are imported from ``refseq_bench``, which links to them."""
ROOMS = {*LINKED, "refseq", "tests"}

LARGEST = 1 << 20
"""Bytes of a tracked file; the largest picture of the pages has half as many."""
FOREIGN = {
    "machine path": re.compile(r"(?<![\w.~-])/(?:(?:home|Users)/\w|(?:root|work|mnt)/)"),
    "registry address": re.compile(
        r"(?:https?|file)://\S*(?:/simple\b|pypi\.|pythonhosted)|index[-_]url", re.IGNORECASE
    ),
}


def foreign(text: str) -> list[str]:
    return [f"{kind}: {found.group()}" for kind, pattern in FOREIGN.items() for found in pattern.finditer(text)]


def tracked() -> list[Path]:
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout, so nothing tells what is tracked")
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
    return [ROOT / name for name in names.split("\0") if name and (ROOT / name).is_file()]


def test_nothing_large_is_tracked():
    """Recordings, maps and reports are made, not kept: each would stay in every clone for good."""
    assert [path for path in tracked() if path.stat().st_size > LARGEST] == []


# Put together here, so that this file does not hold what it looks for.
@pytest.mark.parametrize("folder", ["home/ann", "Users/ann", "root", "work"])
def test_the_search_for_machine_paths_finds_one(folder):
    assert foreign(f"cd /{folder}/bench")


@pytest.mark.parametrize(
    "line", ["--extra-index" + "-url=x", "https" + "://pypi.org/p/numpy", "file" + ":///srv/simple"]
)
def test_the_search_for_registries_finds_one(line):
    assert foreign(line)


@pytest.mark.parametrize("line", ["~/home/x", "docs/work/x.md", "numpy==2.0", "https://mujoco.org", "/usr/bin/env"])
def test_the_search_passes_what_is_no_ones_machine(line):
    assert foreign(line) == []


def test_nothing_tracked_names_a_machine_or_a_registry():
    found = {str(path.relative_to(ROOT)): foreign(path.read_text(errors="replace")) for path in tracked()}
    here = [str(path) for path in tracked() if f"{ROOT}/" in path.read_text(errors="replace")]
    assert {name: kinds for name, kinds in found.items() if kinds} == {}
    assert here == []


def test_python_lives_in_the_rooms():
    assert {path.relative_to(ROOT).parts[0] for path in tracked() if path.suffix == ".py"} == {*ROOMS, "refseq_bench"}


MOST_FILES = 18
"""Python files in a folder: more and nobody finds one's way by its names."""


def test_no_folder_holds_more_files_than_one_finds_one_s_way_in():
    folders = Counter(path.relative_to(ROOT).parent for path in tracked() if path.suffix == ".py")
    assert {str(folder): files for folder, files in folders.items() if files > MOST_FILES} == {}


SHORT = 100
"""Characters of a function's body that may be written twice: a line is found sooner than its helper."""
HOOKS = {"__getattr__", "__dir__"}
"""Every package has its own: what imports late cannot import a helper for it."""


Definition = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def definitions(tree: ast.Module) -> Iterator[Definition]:
    """The module itself, its classes and functions: statements are gone through, not the expressions in them."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, Definition):
            yield node
        for block in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting.extend(getattr(node, block, ()))


def twins(trees: Mapping[str, ast.Module]) -> list[list[str]]:
    """Longer functions of the same arguments and bodies, without docstrings, by program and name."""
    alike: dict[tuple[object, ...], list[tuple[str, ast.FunctionDef, list[ast.stmt]]]] = {}
    for file, tree in trees.items():
        for node in definitions(tree):
            if isinstance(node, ast.FunctionDef) and node.name not in HOOKS:
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                shape = (*(one.arg for one in node.args.args), *map(type, body))
                alike.setdefault(shape, []).append((f"{file}: {node.name}", node, body))
    found: dict[str, list[str]] = {}
    for name, node, body in (one for some in alike.values() if len(some) > 1 for one in some):
        written = "\n".join(map(ast.unparse, body))
        if len(written) > SHORT:
            found.setdefault(f"{ast.unparse(node.args)}: {written}", []).append(name)
    return [names for names in found.values() if len(names) > 1]


def test_the_search_for_twins_finds_them():
    body = f"return value + {'1' * SHORT}"
    one, two = (f"def {name}(value):\n    {body}\n" for name in ("one", "two"))
    nested = "if one:\n    class Other:\n" + indent(two, " " * 8)
    assert twins({"a": ast.parse(one + nested)}) == [["a: one", "a: two"]]


def test_no_function_is_written_twice():
    programs = [path for path in tracked() if path.suffix == ".py"]
    trees = {
        str(path.relative_to(ROOT)): parsed(path) for path in programs if path.relative_to(ROOT).parts[0] != "tests"
    }
    assert twins(trees) == []


def classes_and_docstrings(tree: ast.Module) -> tuple[list[str], list[str]]:
    there = list(definitions(tree))
    named = [node.name for node in there if isinstance(node, ast.ClassDef)]
    return named, [text for node in there if (text := ast.get_docstring(node))]


def test_docstrings_begin_with_words_and_name_what_there_is():
    # No tree is kept: of millions of nodes each look for garbage would take long.
    found = {path: classes_and_docstrings(parsed(path)) for path in tracked() if path.suffix == ".py"}
    classes = {name for named, _ in found.values() for name in named}
    modules = {path.stem for path in found}
    told = [(path.name, text) for path, (_, texts) in found.items() for text in texts]
    # Words that are a class as well, as Map, begin sentences; a name of two words never does.
    begun = [(name, first) for name, text in told if re.match(r"[A-Z][a-z]+[A-Z]", first := text.split()[0])]
    assert [(name, first) for name, first in begun if first in classes] == []
    named = [
        (name, f"{module}.{called}")
        for name, text in told
        for module, called in re.findall(r"``(?:[\w.]+\.)?(\w+)\.([A-Z]\w*[a-z]\w*)``", text)
    ]
    assert [one for one in named if one[1].split(".")[0] in modules and one[1].split(".")[1] not in classes] == []


def test_every_room_is_shipped_and_watched_over():
    rooms = ROOMS - {"tests"}
    contracts = PROJECT["tool"]["importlinter"]
    layers = [re.split(r"\s*\|\s*", layer) for layer in contracts["contracts"][0]["layers"]]
    packages = ["refseq", "refseq_bench"]
    assert PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"] == packages
    assert contracts["root_packages"] == packages
    assert {name.removeprefix("refseq_bench.") for name in itertools.chain(*layers)} == {*rooms, "text_file"}
    assert {link.name: link.readlink() for link in (ROOT / "refseq_bench").iterdir() if link.is_symlink()} == {
        room: Path("..", room) for room in LINKED
    }


@pytest.mark.parametrize("room", sorted(LINKED))
def test_a_room_has_one_name_only(room):
    """Under a second one all its classes would be there twice."""
    told = subprocess.run(
        [sys.executable, "-c", f"import {room}"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert told.stderr.splitlines()[-1] == f"ImportError: '{room}' is imported as 'refseq_bench.{room}'"


@pytest.mark.parametrize("page", [*sorted(ROOMS - {"tests"}), "house", "index"])
def test_every_room_has_a_page(page):
    text = (ROOT / "docs" / f"{page}.md").read_text()
    assert text.startswith("# ")
    assert len(text.split()) > 50


def test_the_index_leads_to_every_page():
    links = set(re.findall(r"\]\(([\w/-]+\.md)\)", (ROOT / "docs" / "index.md").read_text()))
    assert {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"} <= links
    assert [link for link in links if not (ROOT / "docs" / link).is_file()] == []


def test_the_newest_version_in_the_changelog_is_the_project_s():
    versions = re.findall(r"^## \[(\d+\.\d+\.\d+)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert versions[0] == PROJECT["project"]["version"]
    assert versions == sorted(versions, key=Version, reverse=True)


# The lock


def pins() -> list[Requirement]:
    """The pins of the lock; any line that is neither a pin with hashes nor a hash fails."""
    text = (ROOT / "requirements.lock").read_text().replace("\\\n", "")
    lines = [line.split(" --hash=") for line in text.splitlines()]
    for line in lines:
        assert re.fullmatch(r"[a-z0-9-]+==[\w.]+(?: ; [^#@]+)?\s*", line[0]), line[0]
        assert line[1:], f"{line[0]} has no hash"
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}\s*", digest) for digest in line[1:]), line[0]
    return [Requirement(line[0]) for line in lines]


MACHINES = [
    {
        "python_version": version,
        "python_full_version": f"{version}.4",
        "platform_machine": machine,
        "sys_platform": "linux",
        "platform_system": "Linux",
        "os_name": "posix",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
    }
    for version in ("3.11", "3.12", "3.13")
    for machine in ("x86_64", "aarch64")
]


@pytest.mark.parametrize("machine", MACHINES, ids=lambda m: f"{m['python_version']}-{m['platform_machine']}")
def test_the_lock_gives_each_machine_one_version_that_the_project_accepts(machine):
    locked = [pin for pin in pins() if pin.marker is None or pin.marker.evaluate(machine)]
    versions = {pin.name: str(pin.specifier).removeprefix("==") for pin in locked}
    demands = PROJECT["project"]["dependencies"] + PROJECT["dependency-groups"]["dev"]
    assert len(versions) == len(locked)
    for demand in map(Requirement, demands):
        assert demand.specifier.contains(versions[canonicalize_name(demand.name)]), demand


# `run`


def call(script: Path, *arguments: str, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        ["sh", script, *arguments], capture_output=True, text=True, timeout=60, check=False, **options
    )


def test_scripts_are_executable_and_have_no_syntax_error():
    for shell, script in (("sh", ROOT / "run"), ("bash", ROOT / ".ci" / "run")):
        assert os.access(script, os.X_OK)
        assert subprocess.run([shell, "-n", script], check=False).returncode == 0


def test_help_is_printed_through_a_symbolic_link_in_another_folder(tmp_path):
    (tmp_path / "bench").symlink_to(ROOT / "run")
    told = call(Path("bench"), "help", cwd=tmp_path)
    assert told.returncode == 0
    assert all(command in told.stdout for command in ("demo", "tests", "attacks", "refseq", "lint", "docs", "help"))


def test_an_unknown_command_is_named_with_the_valid_ones():
    told = call(ROOT / "run", "demmo")
    assert told.returncode == 2
    valid = "demo, tests, coverage, bench, attacks, audit, refseq, lint, docs, help"
    assert told.stderr == f"run: unknown command 'demmo'; valid: {valid}\n"


def put_tool(bare: Path, name: str, script: str) -> None:
    (bare / "tools" / name).write_text(f"#!/bin/sh\n{script}\n")
    (bare / "tools" / name).chmod(0o755)


@pytest.fixture
def bare(tmp_path):
    """A checkout on a machine that has a shell and its small tools, and nothing else."""
    for name in ("run", "pyproject.toml", "requirements.lock"):
        shutil.copy(ROOT / name, tmp_path / name)
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("sh", "cat", "cksum", "date", "dirname", "readlink"):
        (tools / name).symlink_to(shutil.which(name))
    put_tool(tmp_path, "id", "echo 0")
    return tmp_path


def refusal(bare: Path) -> str:
    told = call(bare / "run", "tests", env={"PATH": str(bare / "tools")})
    assert told.returncode == 2
    assert not (bare / ".venv").exists()
    return told.stderr


def test_without_python_the_line_to_type_is_told(bare):
    assert refusal(bare) == ("run: no Python 3.11, 3.12 or 3.13; type: apt-get install -y python3 python3-venv\n")


def test_an_old_python_is_not_taken(bare):
    put_tool(bare, "python3", "exit 1")
    assert refusal(bare) == ("run: no Python 3.11, 3.12 or 3.13; type: apt-get install -y python3.11 python3.11-venv\n")


def test_a_python_without_venv_is_told_how_to_get_it(bare):
    put_tool(bare, "python3.12", 'case "$*" in *ensurepip*) exit 1 ;; esac')
    assert refusal(bare) == (
        "run: python3.12 cannot make a virtual environment; type: apt-get install -y python3.12-venv\n"
    )


@pytest.mark.parametrize(
    ("tool", "line"),
    [
        ("id", "su -c 'apt-get install -y python3 python3-venv'"),
        ("sudo", "sudo apt-get install -y python3 python3-venv"),
    ],
)
def test_the_line_to_type_suits_who_is_not_root(bare, tool, line):
    put_tool(bare, tool, "exit 1")
    put_tool(bare, "id", "echo 1000")
    assert refusal(bare) == f"run: no Python 3.11, 3.12 or 3.13; type: {line}\n"
