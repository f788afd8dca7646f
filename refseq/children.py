"""Child processes that end with the process that started them, whatever signal ends that one."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from threading import Thread

LOOK = 1.0
"""Period in which a worker looks whether its parent lives [s]."""
ENDING = 5.0
"""Seconds in which a child ends that is told to."""

SUPERVISOR = """
import ctypes, os, signal, subprocess, sys, threading
signal.signal(signal.SIGINT, signal.SIG_IGN)
def bind():
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
def follow():
    os.read(0, 1)
    os.killpg(0, signal.SIGKILL)
threading.Thread(target=follow, daemon=True).start()
quiet = subprocess.DEVNULL
sys.exit(subprocess.call(sys.argv[1:], stdin=quiet, preexec_fn=bind))
"""
"""A program between parent and child, which lead a process group. It ends the group as soon as nobody holds the other
end of its standard input: whatever ends the parent closes that end. SIGKILL, as a stopped process takes no other."""


def start_tied(words: Sequence[str]) -> "subprocess.Popen[bytes]":
    """Start a program without a terminal that ends with this process; ``end_tied`` ends it before.

    On Windows it is only ended by ``end_tied``.
    """
    supervised = words if sys.platform == "win32" else [sys.executable, "-I", "-S", "-c", SUPERVISOR, *words]
    return start_apart(supervised, stdin=subprocess.PIPE)


def start_apart(words: Sequence[str], stdin: int = subprocess.DEVNULL) -> "subprocess.Popen[bytes]":
    """Start a program without a terminal, and in a session of its own, that goes on when this process ends."""
    quiet = subprocess.DEVNULL
    return subprocess.Popen(list(words), stdin=stdin, stdout=quiet, stderr=quiet, start_new_session=True)


def end_tied(process: "subprocess.Popen[bytes]") -> None:
    """End a program that was started by either, with all that it started itself, and wait until it is gone."""
    if process.stdin is not None:
        process.stdin.close()
    if sys.platform == "win32":
        process.kill()
        process.wait(ENDING)
        return
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(subprocess.TimeoutExpired, ProcessLookupError, PermissionError):
        process.wait(ENDING)
        end = time.monotonic() + ENDING
        while time.monotonic() < end:
            os.killpg(process.pid, 0)  # fails when the group is gone
            time.sleep(0.01)


def signal_name(number: int) -> str:
    """A signal's name; of the real-time ones only the first and the last have one."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def follow_parent(parent: int) -> None:
    """End this process when the one that started it, ``parent``, is gone: nobody waits for its work any more.

    Called first in a worker, which a pool would leave waiting for ever.
    """
    Thread(target=_follow, args=(parent,), daemon=True).start()


def _follow(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(1)
