"""Try an attack many times: what falls is told and its input kept, and the next try follows."""

import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from unittest import SkipTest

from tests.robustness.attack import Attack, Attempt


@dataclass(frozen=True)
class Fall:
    """A try that fell: its seed, the line that tells what fell, and the folder that holds its input."""

    seed: int
    told: str
    kept: str


@dataclass(frozen=True)
class Row:
    """An attack's row in the table: ``tries`` were made, in ``seconds`` on the clock; or why it is skipped here.

    ``in_full`` is the number of tries that belongs to the attack.
    """

    name: str
    family: str
    promise: str
    in_full: int
    tries: int
    seed: int = 0
    falls: list[Fall] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    skipped: str = ""

    @property
    def survived(self) -> int:
        """The number of tries that survived."""
        return self.tries - len(self.falls)


def run(one: Attack, tries: int, seed: int, kept: Path) -> Row:
    """Try an attack with ``tries`` seeds from ``seed`` on; inputs of those that fell stay in ``kept/NAME/SEED``."""
    if not tries:
        return Row(one.name, one.family, one.promise, one.tries, 0, seed, skipped="takes too long for the short form")
    falls: list[Fall] = []
    figures: dict[str, float] = {}
    began = time.monotonic()
    for number in range(seed, seed + tries):
        folder = kept / one.name / str(number)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        try:
            attempt = _try(one, number, folder)
        except SkipTest as reason:
            shutil.rmtree(folder)
            return Row(one.name, one.family, one.promise, one.tries, 0, seed, skipped=str(reason))
        for unit, figure in attempt.figures.items():
            figures[unit] = max(figure, figures.get(unit, figure))
        if attempt.fell is None:
            shutil.rmtree(folder, ignore_errors=True)
        else:
            falls.append(Fall(number, " ".join(attempt.fell.split("\n")), str(folder)))
            print(f"{one.name} fell with seed {number}: {falls[-1].told} (kept in {folder})", file=sys.stderr)
    return Row(one.name, one.family, one.promise, one.tries, tries, seed, falls, figures, time.monotonic() - began)


def _try(one: Attack, seed: int, folder: Path) -> Attempt:
    try:
        with _limited(one.limit):
            told = one.function(seed, folder)
    except SkipTest:
        raise
    except Exception as error:
        (folder / "traceback.txt").write_text(traceback.format_exc())
        return Attempt(f"{type(error).__name__}: {error}")
    return told if isinstance(told, Attempt) else Attempt(told)


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in the block when it takes longer."""

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise TimeoutError(f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
