"""Running the command line in this process, and a browser to open its pages in."""

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from playwright.sync_api import Browser, sync_playwright

from refseq_bench.scenarios.cli import app

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
DRAWN_BY_CPU = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing")
"""So that a page that draws a world does so without a graphics card."""


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
            app.main()
        except SystemExit as left:
            code = int(left.code or 0)
        said = capsys.readouterr()
        return Answer(code, said.out, said.err)

    return run


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, without a window.

    It is a module's: while it is there this thread runs a loop, and no command can begin one.
    """
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"needs one of {', '.join(BROWSERS)}")
    # Chromium's sandbox refuses to start for root.
    alone = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=found, args=[*alone, *DRAWN_BY_CPU])
        yield started
        started.close()
