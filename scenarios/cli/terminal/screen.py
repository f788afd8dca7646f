"""The viewer that commands show things in, and files for it."""

import os
import shlex
import shutil
import sysconfig
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from refseq.errors import RefseqError
from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import Screen
from refseq_bench.scenarios.drives.inputs import writing
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    import rerun as rr


# Rerun, which is imported later, tells on the terminal in several lines what goes wrong; ours is one line.
os.environ.setdefault("RUST_LOG", "off")


def rerun_command(*files: Path) -> str:
    """A command, to be typed where one stands, that shows files: in a window, without a display in a browser."""
    from refseq.access.policy import LOOPBACK
    from refseq.viewer.checks import check_display

    program = Path(sysconfig.get_path("scripts")) / "rerun"
    if shutil.which("rerun"):
        name = "rerun"
    else:
        name = str(program.relative_to(Path.cwd()) if program.is_relative_to(Path.cwd()) else program)
    try:
        check_display()
    except RefseqError:
        return shlex.join([name, "--bind", LOOPBACK, "--serve-web", *map(str, files)])
    return shlex.join([name, *map(str, files)])


def page_told(name: str) -> Callable[[str], None]:
    """Print the address of the page on which a robot is led."""
    return lambda address: say(out, f"{name}: open {address} in a browser of this machine")


@contextmanager
def in_file(path: Path, name: str) -> "Iterator[rr.RecordingStream]":
    """A stream to a file for the viewer."""
    from refseq.viewer.recording import saved

    with writing(path), saved(path, name) as stream:
        yield stream
    say(out, f"{path}: open it with '{rerun_command(path)}'")


@contextmanager
def on_screen(name: str, screen: Screen, *, live: bool = False) -> "Iterator[rr.RecordingStream]":
    """A stream to a viewer; browsers are served until Ctrl-C, and told of before a ``live`` drive, else behind."""
    from refseq.viewer.sinks import connected, served, spawned

    batches: dict[str, Any] = {}
    if live:
        from refseq_bench.scenarios.drives.live import LIVE

        batches = {"batches": LIVE}
    if screen.connect is not None:
        with connected(screen.connect, name, **batches) as stream:
            yield stream
        say(out, f"{name}: sent to {screen.connect}")
    elif screen.serve is not None:
        with served(screen.serve, name, screen.memory_limit, **batches) as (stream, page):
            line = f"{name}: open {page} in a browser of this machine; Ctrl-C ends it"
            if live:
                say(out, line)
            yield stream
            with suppress(KeyboardInterrupt):  # from the moment the page is told: somebody may be quick
                if not live:
                    say(out, line)
                while True:
                    time.sleep(3600)
    else:
        with spawned(name, screen.memory_limit, **batches) as stream:
            yield stream
