"""Commands of ours that run beside the attack on them: their addresses, their memory, and all processes they began."""

import atexit
import os
import re
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from refseq.access.listener import free_port
from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from tests.support import corridor_drive
from tests.worlds.conftest import SMALL

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import os, sys
from refseq.children import follow_parent
from refseq_bench.scenarios.cli.app import main
follow_parent(os.getppid())
sys.argv[0] = "refseq"
main()
"""
"""The command line; it ends with who attacks it: a worker of pytest may leave without a word."""
MARK = "REFSEQ_ATTACKED"
"""Variable by which all processes of a command are found, also those that lost their parents."""
PATIENCE = 120.0
"""Seconds in which a command says its address on a busy machine."""
COMMANDS = {
    "serve": "serve map.refseq --port 0 --distance 0",
    "view": "view query.mcap --serve PORT",
    "drive": "drive small.toml --sensors laser --port PORT -o drive.mcap",
    "robot": "robot serve robuter --world small.toml --tcp 0",
    "live": "live map.refseq small.toml --sensors laser --renderer none --serve PORT",
    "campaign": "scenario run campaign.toml -j 2 --cache cache",
}
"""Commands that listen or start processes."""
CAMPAIGN = """\
title = "Two drives at a time"
seeds = [1, 2, 3, 4]
expect = ["success_hmm >= 0 %"]

[reference]
world = "corridor:7"
light = "16:00"
renderer = "none"

[query]
light = "18:00"
"""


@dataclass
class Command:
    """A command that runs, and the address that it printed."""

    process: "subprocess.Popen[str]"
    folder: Path
    mark: str = field(repr=False)
    address: str = ""

    @property
    def port(self) -> int:
        """The port of its address."""
        return int(re.search(r":(\d+)", self.address.partition("//")[2] or self.address)[1])

    @property
    def token(self) -> str:
        """The token of its address."""
        return re.search(r"[0-9a-f]{32}$", self.address)[0]

    def processes(self) -> list[int]:
        """All processes that it began and that still run."""
        found = []
        for entry in Path("/proc").iterdir():
            with suppress(OSError):
                if entry.name.isdigit() and f"{MARK}={self.mark}".encode() in (entry / "environ").read_bytes():
                    found.append(int(entry.name))
        return found

    def memory(self) -> float:
        """Resident memory of all its processes [MB]."""
        total = 0.0
        for pid in self.processes():
            with suppress(OSError):
                total += int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        return total

    def said(self) -> str:
        """Everything on its stderr so far but notes, one line each, on its input and on who was sent away."""
        lines = (self.folder / f"{self.mark}.err").read_text().splitlines()
        return "\n".join(line for line in lines if not line.startswith(("note: ", "a connection is closed: ")))

    def left(self, seconds: float) -> str | None:
        """The processes that still run after so long, in a line."""
        if not until(lambda: not self.processes(), seconds):
            pids = self.processes()
            names = [Path(f"/proc/{pid}/cmdline").read_bytes()[:60].decode(errors="replace") for pid in pids]
            return f"{len(pids)} processes are left: {'; '.join(names)}".replace("\0", " ")
        return None

    def kill(self) -> None:
        """End all of it."""
        for pid in self.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()
        if self.process.stdout:
            self.process.stdout.close()


def until(holds: Callable[[], bool], seconds: float) -> bool:
    """Wait until something holds; tells whether it does."""
    end = time.monotonic() + seconds
    while not (held := holds()) and time.monotonic() < end:
        time.sleep(0.05)
    return held


@cache
def desk() -> Path:
    """A folder with a map, a recording, a small world and a campaign."""
    home = tempfile.TemporaryDirectory(prefix="attacked")
    atexit.register(home.cleanup)
    folder, rng = Path(home.name), np.random.default_rng(0)
    learn(corridor_drive(rng, 12, size=64)).save(folder / "map.refseq")
    with RecordingWriter(folder / "query.mcap", {}) as writer:
        for view in corridor_drive(rng, 12, size=64):
            writer.write(replace(view, time=view.time + 100), view.truth)
    (folder / "small.toml").write_text(SMALL.format(top="", end=""))
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return folder


def start(name: str, background: bool = False) -> Command:
    """Start one of ``COMMANDS`` without a display, and wait for its address; in the background it ignores Ctrl-C."""
    mark, folder = secrets.token_hex(8), desk()
    words = COMMANDS[name].replace("PORT", str(free_port())).split()
    command: Sequence[str] = [sys.executable, "-c", PROGRAM, *words]
    if background:
        command = ["sh", "-c", '"$@" & wait', "sh", *command]
    known = {key: value for key, value in os.environ.items() if key not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    with (folder / f"{mark}.err").open("w") as err:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env={**known, MARK: mark, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=err,
            text=True,
            start_new_session=True,
        )
    started = Command(process, folder, mark)
    atexit.register(started.kill)
    if name == "campaign":
        until(lambda: len(started.processes()) > 3 + background, PATIENCE)
    while name != "campaign" and not started.address:
        line = process.stdout.readline()
        if not line:
            raise RuntimeError(f"{name} does not run: {started.said()}")
        if found := re.search(r"(?:http|ws)://\S+\w{32}|127\.0\.0\.1:\d+", line):
            started.address = found[0]
    return started


@cache
def running(name: str) -> Command:
    """The same, once for all attacks of this process."""
    return start(name)
