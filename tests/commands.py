"""Commands as pages and CI files give them: read word by word, and held against what `run` and `refseq` take."""

import importlib.util
import re
import shlex
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import typer
from typer.core import TyperGroup

from refseq_bench.scenarios.cli.app import NAMES, command_tree
from tests.pages import ROOT

MISUSED = typer.BadParameter.__base__
"""The family of errors for words that the command line does not take."""
OTHERS = {"pip", "cd", "git", "export", "rerun", "uv", "apt-get", "evo_ape", "evo_traj", "docker", "g++"}
"""Programs that are not ours, of which the pages tell."""


def commands(code: str) -> Iterator[list[str]]:
    """The words of each command of a block, without what comes after a pipe or a redirection."""
    for line in code.replace("\\\n", " ").splitlines():
        words = shlex.split(line.removeprefix("$ "), comments=True)
        for end, word in enumerate(words):
            if word in {"|", "&", "&&", ";", ">", ">>"}:
                words, rest = words[:end], words[end + 1 :]
                if word == "&&":
                    yield from commands(shlex.join(rest))
                break
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            del words[0]
        if words and words[0] != ".":
            yield words


def own(words: list[str]) -> list[str] | None:
    """The words behind ``refseq``, in whatever way that is called; None of another program."""
    if words[:2] == ["./run", "refseq"]:
        return words[2:]
    return words[1:] if Path(words[0]).name == "refseq" else None


def parse(words: list[str]) -> None:
    """Have the real command line read the words, and do nothing. Raises ``MISUSED``."""
    command, name, parent = command_tree(*NAMES), "refseq", None
    while True:
        try:
            context = command.make_context(name, list(words), parent=parent)
        except typer.Exit:  # --help
            return
        if not isinstance(command, TyperGroup):
            return
        rest = [*context._protected_args, *context.args]
        name, found, words = command.resolve_command(context, rest)
        assert found is not None
        command, parent, name = found, context, name or ""


def check_commands(code: str) -> None:
    """Fail on a command that is not there, or does not take its words; programs of others are listed in ``OTHERS``."""
    for words in commands(code):
        ours = own(words)
        program = Path(words[0]).name
        if ours is not None:
            parse(ours)
        elif words[0] in {"./run", ".ci/run"}:
            assert words[1:] == [] or words[1] in run_commands(), words
        elif program.startswith("python") and words[1] == "-m":
            assert importlib.util.find_spec(words[2]), words
        elif program.startswith("python") and words[1] == "-c":
            compile(words[2], "-c", "exec")
        else:
            assert program in OTHERS, words


@cache
def run_commands() -> list[str]:
    """Commands of ``run``, by its own help."""
    told = subprocess.run(["sh", ROOT / "run", "help"], capture_output=True, text=True, check=True).stdout
    return re.findall(r"^  (\w+) ", told, re.MULTILINE)
