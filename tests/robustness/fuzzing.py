"""The command line under damaged input: a command is run in a process of its own, and judged by what it leaves.

``fell`` is all that an attack needs: it writes the damaged file into the folder that it was given, names it in a
command, and returns what ``fell`` returns. A command survives if it ends well, or refuses the input in one line.
"""

import atexit
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.robustness.attack import Attempt
from tests.robustness.worker import CPU_SECONDS, MEMORY, WALL_SECONDS

ROOT = Path(__file__).parents[2]
LONGEST_LINE = 2000
"""A refusal of more characters is not one line to a reader."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


class _Reply(NamedTuple):
    """The worker's account of one command."""

    code: int
    cpu: float
    peak: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """End of a command: its exit code, below zero by a signal; output; CPU time [s] and memory [bytes].

    ``left`` are the files that were not there before, temporary ones among them.
    """

    code: int
    out: str
    err: str
    cpu: float
    peak: int
    left: tuple[str, ...]


def fell(words: Sequence[str], folder: Path, codes: Collection[int] = (0, 2)) -> str | None:
    """Run ``refseq WORDS`` in ``folder`` and tell what is wrong with how it ended; None where nothing is.

    Survived is an exit code among ``codes``: 2 with one line on stderr and nothing written, another one with output;
    notes on stderr are no lines. All in less than 5 s of CPU and 1 GB. The words name files relative to the folder.
    """
    return judged(run(words, folder), codes)


def tried(words: Sequence[str], folder: Path, codes: Collection[int] = (0, 2)) -> Attempt:
    """As ``fell``, with the time and the memory that the command took."""
    found = run(words, folder)
    return Attempt(judged(found, codes), {"s of CPU": found.cpu, "MiB": float(found.peak >> 20)})


def run(words: Sequence[str], folder: Path, arms: Mapping[str, Mapping[str, object]] | None = None) -> Outcome:
    """Run ``refseq WORDS`` in ``folder``; with ``arms`` something happens to it: functions of ``sudden``."""
    before = _files(folder)
    with tempfile.TemporaryDirectory() as name:
        aside = Path(name)
        (aside / "tmp").mkdir()
        reply = _worker().ask(words, folder, aside, arms or {})
        left = [*(_files(folder) - before), *_files(aside / "tmp")]
        out, err = ((aside / stream).read_text(errors="replace") for stream in ("out", "err"))
    return Outcome(reply.code, out, err, reply.cpu, reply.peak, tuple(sorted(left)))


def judged(found: Outcome, codes: Collection[int] = (0, 2)) -> str | None:
    """Tell what is wrong with an outcome, in one line; None where nothing is."""
    if found.code < 0:
        why = {-14: f"waited for {WALL_SECONDS} s", -24: f"took {CPU_SECONDS} s of CPU", -9: "was killed"}
        return why.get(found.code, f"ended by signal {-found.code}")
    if found.code not in codes:
        return f"exit code {found.code}: {_last_line(found.err)}"
    if found.cpu > CPU_SECONDS or found.peak > MEMORY:
        return f"took {found.cpu:.1f} s of CPU and {found.peak >> 20} MiB"
    if marks := _CONTROL.search(found.out + found.err):
        return f"printed the control character {marks[0]!r}"
    lines = [line for line in found.err.splitlines() if not line.startswith("note: ")]
    if found.code == 2:
        return _judged_refusal(found, lines)
    if lines:
        return f"exit code {found.code}, and on stderr: {lines[0][:200]}"
    return None if found.out else f"exit code {found.code} without any output"


def _judged_refusal(found: Outcome, lines: Sequence[str]) -> str | None:
    if len(lines) != 1 or not lines[0].startswith("error: "):
        return f"refused in {len(lines)} lines: {' / '.join(lines)[:200]}"
    if len(lines[0]) > LONGEST_LINE:
        return f"refused in a line of {len(lines[0])} characters"
    return f"left {', '.join(found.left)[:200]}" if found.left else None


def _last_line(text: str) -> str:
    return next(reversed(text.strip().splitlines()), "nothing on stderr")[:300]


def _files(folder: Path) -> set[str]:
    return {str(path) for path in folder.rglob("*") if not path.is_dir()}


class _Worker:
    """The process that runs the commands; it is started once, for its imports take seconds."""

    def __init__(self) -> None:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.robustness.worker"],
            cwd=ROOT,
            env={**os.environ, **threads, "PYTHONPATH": str(ROOT), "COLUMNS": "200"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        atexit.register(self.close)
        assert self._answer() == "ready", "the worker imports everything"

    def ask(self, words: Sequence[str], folder: Path, aside: Path, arms: Mapping[str, object]) -> _Reply:
        """Run one command. Raises ``RuntimeError`` where the worker itself has ended."""
        assert self._process.stdin is not None
        request = {"words": list(words), "folder": str(folder.resolve()), "aside": str(aside), "arms": arms}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return _Reply(**json.loads(self._answer()))

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the worker ended with {self._process.wait()}; its own stderr tells why")
        return line.strip()

    def close(self) -> None:
        """End the worker."""
        self._process.kill()
        self._process.wait()


@cache
def _worker() -> _Worker:
    return _Worker()
