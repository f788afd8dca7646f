"""Tasks that do as they are told, and scenarios that take seconds: for tests of who runs tasks."""

import os
import signal
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import cv2

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, RecordTask, Task, perform
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, DamagedError, Store
from tests.worlds.conftest import SMALL

WHOLE = b"PAR1 what was made PAR1"
BITS = b"PAR1 what was mode PAR1"
SCENARIO = """
title = "A small corridor, laser only"
seeds = {seeds}
expect = ["success >= 0 %"]
[reference]
world = "small.toml"
renderer = "none"
trigger = {{ distance = 0.4 }}
[query]
light = "18:00"
[localise]
methods = ["thesis"]
"""


@dataclass(frozen=True)
class Chore:
    """A task that ``does`` something; it takes its needs to be there and whole."""

    key: str
    does: str = "write"
    needs: tuple["Chore", ...] = ()
    limit: float = 600.0
    ending: str = ANSWERS

    @property
    def kind(self) -> str:
        return self.does

    @property
    def title(self) -> str:
        return f"{self.does} {self.key}"

    def carry_out(self, store: Store) -> None:
        for need in self.needs:
            if not _is_whole(store.path(need.key, need.ending)):
                raise DamagedError(need.key, f"{need.key} is damaged")
        store.make(self.key, self.ending, self._make)

    def _make(self, path: Path) -> None:
        path.write_bytes(WHOLE[: len(WHOLE) // 2])
        match self.does:
            case "hang":
                time.sleep(600)
            case "sleep":
                time.sleep(1.0)
            case "raise":
                raise ValueError("in two\nlines")
            case "tell":
                found = {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
                path.write_text(f"PAR1 {os.getpid()} {sorted(found.values())} {cv2.getNumThreads()} PAR1")
                return
        path.write_bytes(WHOLE)


def _is_whole(path: Path) -> bool:
    try:
        return path.read_bytes() == WHOLE
    except OSError:  # discarded since somebody else met the damage
        return False


class AtOnce:
    """Carries tasks out here and now, in this process: no worker has to be started."""

    workers = 1

    def __init__(self, store: Store) -> None:
        self._store = store

    def submit(self, task: Task) -> "Future[TaskOutcome]":
        """Carry it out."""
        future: Future[TaskOutcome] = Future()
        future.set_result(perform(task, self._store))
        return future

    def close(self, *, at_once: bool) -> None:
        """Nothing to let go."""


class Hanging(RecordTask):
    """A drive that never ends."""

    def carry_out(self, store: Store) -> None:
        Chore("forever", "hang").carry_out(store)


class Dying(RecordTask):
    """A drive in which the process is killed."""

    def carry_out(self, store: Store) -> None:
        signal.raise_signal(signal.SIGKILL)


def case_of(name: str, *chores: Chore) -> Case:
    """What a campaign needs of a case, where ``tasks_of`` and ``judged`` are those below."""
    return cast(Case, SimpleNamespace(name=name, chores=chores))


def chores_of(case: Case) -> dict[int, Sequence[Chore]]:
    """In place of ``tasks_of``."""
    return {1: case.chores}  # type: ignore[attr-defined]


def judged_by_outcomes(
    case: Case, tasks: Mapping[int, Sequence[AnswerTask]], outcomes: Mapping[str, TaskOutcome], store: Store
) -> Judged:
    """In place of ``judged``: an error where a task is one; reads what the tasks have left, as judging does."""
    ended = [outcomes[task.key] for task in tasks[1]]
    for task in tasks[1]:
        if outcomes[task.key].good and store.path(task.key, task.ending).read_bytes() == BITS:
            raise DamagedError(task.key, f"{task.key} is damaged")
    bad = [outcome for outcome in ended if not outcome.good]
    verdict = bad[0].verdict if bad else Verdict.PASSED
    return Judged(case, verdict, tuple(outcome.reason for outcome in bad), (), (), (), {}, {}, 0.0)


def scenario_in(folder: Path, seeds: Sequence[int] = (1,), more: str = "") -> Path:
    """A scenario of cheap drives."""
    (folder / "small.toml").write_text(SMALL.format(top="", end=""))
    file = folder / "tiny.toml"
    file.write_text(SCENARIO.format(seeds=list(seeds)) + more)
    return file
