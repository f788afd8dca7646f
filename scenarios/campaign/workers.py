"""Workers on this machine: processes of their own, so that what breaks in one breaks nothing else."""

import multiprocessing
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as OutOfTime
from pathlib import Path
from typing import Any, Protocol

from pebble import ProcessExpired, ProcessPool

from scenarios.campaign.outcomes import Outcome, Verdict
from scenarios.campaign.store import Store
from scenarios.campaign.tasks import AnswerTask, Task, perform


class Executor(Protocol):
    """Who carries tasks out, somewhere, and puts what they make into the campaign's store."""

    workers: int

    def submit(self, task: Task) -> "Future[Outcome]":
        """Carry a task out; all that it needs is in the store. The outcome is in the future; it raises nothing."""

    def close(self, *, at_once: bool) -> None:
        """Let the workers go: when they are done, or at once."""


class LocalWorkers:
    """Spawned processes on this machine; a forked one would hang after its parent has rendered."""

    def __init__(self, workers: int, folder: Path) -> None:
        self.workers = workers
        self._folder = folder
        self._pool = ProcessPool(max_workers=workers, context=multiprocessing.get_context("spawn"))

    def submit(self, task: Task) -> "Future[Outcome]":
        """Carry a task out in one of the processes; one that takes too long is ended."""
        return self.call(lambda error: broken(task, error), task.limit, _perform, task, self._folder)

    def call(
        self, mishap: Callable[[BaseException], Any], limit: float | None, function: Callable[..., Any], *given: Any
    ) -> "Future[Any]":
        """Call a function in one of the processes; what goes wrong there is what ``mishap`` makes of it."""
        answer: Future[Any] = Future()
        answer.set_running_or_notify_cancel()

        def done(future: "Future[Any]") -> None:
            try:
                answer.set_result(future.result())
            except BaseException as error:
                answer.set_result(mishap(error))

        self._pool.schedule(function, args=given, timeout=limit).add_done_callback(done)
        return answer

    def close(self, *, at_once: bool) -> None:
        """Let the processes go."""
        if at_once:
            self._pool.stop()  # type: ignore[no-untyped-call]
        else:
            self._pool.close()  # type: ignore[no-untyped-call]
        self._pool.join()


def _perform(task: Task, folder: Path) -> Outcome:
    return perform(task, Store(folder))


def broken(task: Task, error: BaseException) -> Outcome:
    """What a task's outcome is when its process ended in the middle of it."""
    if isinstance(error, OutOfTime):
        # Who takes for ever to answer has failed; a drive that takes so long is the bench's own affair.
        verdict = Verdict.FAILED if isinstance(task, AnswerTask) else Verdict.ERROR
        return Outcome(verdict, f"{task.title}: not done within {task.limit:g} s (limits.seconds)", seconds=task.limit)
    if isinstance(error, ProcessExpired):
        return Outcome(Verdict.ERROR, f"{task.title}: the worker's process ended (exit code {error.exitcode})")
    return Outcome(Verdict.ERROR, f"{task.title}: {type(error).__name__}: {' '.join(str(error).split())}")
