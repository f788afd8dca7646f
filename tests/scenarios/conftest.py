"""Running the command line in this process."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from scenarios import cli


class Answer(NamedTuple):
    """What a command left: its exit code and what it said."""

    code: int
    out: str
    err: str


Refseq = Callable[..., Answer]


@pytest.fixture
def refseq(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Refseq:
    """Run a command as its script does, in this process."""

    def run(*words: str | Path) -> Answer:
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", ["refseq", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as left:
            code = int(left.code or 0)
        said = capsys.readouterr()
        return Answer(code, said.out, said.err)

    return run
