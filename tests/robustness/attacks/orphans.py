"""Signals to commands that start processes: nothing of theirs runs on. And viewers that stall."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from tests.robustness.attack import Attempt, attack
from tests.robustness.commands import COMMANDS, ROOT, start

SIGNALS = (signal.SIGTERM, signal.SIGKILL, signal.SIGINT, signal.SIGHUP)
ORDER = ("view", "campaign", "live", "drive", "serve", "robot")
END = 30.0
"""Seconds in which everything has ended, on a busy machine."""


@attack(
    family="children", promise="Whatever signal ends a command, in the foreground or not, nothing of it runs on",
    tries=2 * len(ORDER) * len(SIGNALS), short=1,
)  # fmt: skip
def orphans(seed: int, folder: Path) -> Attempt:
    name = ORDER[seed % len(ORDER)]
    how = SIGNALS[seed // len(ORDER) % len(SIGNALS)]
    background = seed // (len(ORDER) * len(SIGNALS)) % 2 == 1
    assert set(ORDER) == set(COMMANDS)
    command = start(name, background)
    try:
        count = len(command.processes())
        leader = _child_of(command.process.pid) if background else command.process.pid
        os.kill(leader, how)
        if background and how is signal.SIGINT:  # which is ignored there, as a shell wants it
            time.sleep(0.5)
            os.kill(leader, signal.SIGTERM)
        began = time.monotonic()
        left = command.left(END)
        told = f"{name}, {how.name}{' in the background' if background else ''}: {left}" if left else None
        return Attempt(told, {"processes": count, "s to end": time.monotonic() - began})
    finally:
        command.kill()


def _child_of(shell: int) -> int:
    """The process that a shell started."""
    return int(Path(f"/proc/{shell}/task/{shell}/children").read_text().split()[0])


STALLING = """
import os, signal, sys, time, resource
import numpy as np, rerun as rr
from refseq.errors import RefseqError
from refseq.viewer.sinks import connected
picture = np.random.default_rng(1).integers(0, 256, (480, 640), dtype=np.uint8)
began, said = time.monotonic(), ""
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    with connected(sys.argv[1], "a drive") as stream:
        for number in range(1000):
            stream.set_time("view", sequence=number)
            stream.log("picture", rr.Image(picture))
            if number == 20 and len(sys.argv) > 2:
                os.kill(int(sys.argv[2]), signal.SIGSTOP)
except RefseqError as error:
    said = str(error)
grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
print(f"{time.monotonic() - began:.1f} {grown:.0f} {said}")
"""


@attack(
    family="children", promise="A viewer that stalls does not hold up what is logged: once 5 s, then it is cut off",
    tries=6, short=1,
)  # fmt: skip
def stalled_viewer(seed: int, folder: Path) -> Attempt:
    from refseq.children import end_tied, start_tied
    from refseq.viewer import sinks

    with ExitStack() as stack:
        if seed % 2 == 0:
            words = [_mute(stack)]
        else:
            hidden = sinks.HiddenPort()
            viewer = start_tied([*sinks.PROGRAM, "--serve-grpc", *hidden.words])
            stack.callback(end_tied, viewer)
            sinks._wait(viewer, hidden)
            words = [hidden.address, str(_listening(hidden.port))]
        run = subprocess.run(
            [sys.executable, "-c", STALLING, *words],
            env={**os.environ, "PYTHONPATH": str(ROOT), "RUST_LOG": "off"},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    if run.returncode or run.stderr:
        return Attempt(f"it ended with {run.returncode}: {run.stderr[-300:]}")
    seconds, grown, said = run.stdout.split(" ", 2)
    figures = {"s": float(seconds), "MB grown": float(grown)}
    if "has stalled" not in said or said.count("\n") > 1:
        return Attempt(f"it said {said!r}", figures)
    return Attempt(f"{grown} MB" if float(grown) > 300 else None, figures)


def _mute(stack: ExitStack) -> str:
    """The address of somebody who greets as a server of HTTP/2, and then takes nothing."""
    server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
    kept: list[socket.socket] = []

    def serve() -> None:
        while True:
            try:
                line, _ = server.accept()
            except OSError:
                return
            line.sendall(bytes([0, 0, 0, 4, 0, 0, 0, 0, 0]))
            kept.append(line)

    threading.Thread(target=serve, daemon=True).start()
    return f"rerun+http://127.0.0.1:{server.getsockname()[1]}/proxy"


def _listening(port: int) -> int:
    """The process of Rerun that listens at a port."""
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0") if entry.name.isdigit() else []
        except OSError:
            continue
        if words and words[0].endswith(b"rerun") and str(port).encode() in words:
            return int(entry.name)
    raise RuntimeError(f"no viewer listens at {port}")
