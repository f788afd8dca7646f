"""Workers on this machine: processes of their own, so that what breaks in one breaks nothing else."""

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as OutOfTime
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from threading import Lock
from typing import Protocol, TypeVar

from pebble import ProcessExpired, ProcessPool
from pebble.pool.base_pool import PoolStatus

from refseq.children import signal_name
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict, one_line
from refseq_bench.scenarios.campaign.run.tasks import Question, Task, perform
from refseq_bench.scenarios.campaign.run.worker_init import call_and_trim, init_worker, share
from refseq_bench.scenarios.campaign.store.cache import Store

T = TypeVar("T")
TRIES = 3
"""Number of times that a task is handed out which no process began: one died idle, and took the pool with it."""


class WorkerPool(Protocol):
    """Workers that carry tasks out, and put what they make into the campaign's store."""

    @property
    def workers(self) -> int:
        """Number of tasks at a time; 0 while there is no worker."""

    def submit(self, task: Task) -> "Future[TaskOutcome]":
        """Carry a task out; all that it needs is in the store. The outcome is in the future; it raises nothing."""

    def close(self, *, at_once: bool) -> None:
        """Let the workers go: when they are done, or at once; what they then had in hand never ends."""


class Processes:
    """Spawned processes on this machine, ``count`` at a time; a forked one would hang after its parent has rendered.

    ``sharing`` is among how many the cores are shared out, where others work beside these.
    """

    def __init__(self, count: int, sharing: int | None = None) -> None:
        self._count, self._threads = count, share(sharing or count)
        self._lock = Lock()
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPool:
        return ProcessPool(
            max_workers=self._count,
            initializer=init_worker,
            initargs=(os.getpid(), self._threads),
            context=multiprocessing.get_context("spawn"),
        )

    def call(
        self, mishap: Callable[[BaseException], T], limit: float | None, function: Callable[..., T], *given: object
    ) -> "Future[T]":
        """Call a function in one of the processes; what goes wrong there is what ``mishap`` makes of it."""
        answer: Future[T] = Future()
        answer.set_running_or_notify_cancel()

        def hand_out(tries: int) -> None:
            def done(future: "Future[T]") -> None:
                try:
                    answer.set_result(future.result())
                except BrokenProcessPool as error:
                    hand_out(tries - 1) if tries > 1 else answer.set_result(mishap(error))
                except BaseException as error:
                    answer.set_result(mishap(error))

            try:
                pool = self._working_pool()
                pool.schedule(call_and_trim, args=(function, *given), timeout=limit).add_done_callback(done)
            except RuntimeError as error:  # it was closed
                answer.set_result(mishap(error))

        hand_out(TRIES)
        return answer

    def _working_pool(self) -> ProcessPool:
        """The pool, or a new one where it broke."""
        with self._lock:
            if self._pool._context.status == PoolStatus.ERROR:
                self._pool = self._new_pool()
            return self._pool

    def close(self, *, at_once: bool) -> None:
        """Let the processes go."""
        if at_once:
            self._pool.stop()  # type: ignore[no-untyped-call]
        else:
            self._pool.close()  # type: ignore[no-untyped-call]
        self._pool.join()


class LocalWorkers(Processes):
    """The executor of this machine: what its processes make goes into the store in ``folder``."""

    def __init__(self, workers: int, folder: Path) -> None:
        super().__init__(workers)
        self.workers, self._folder = workers, folder

    def submit(self, task: Task) -> "Future[TaskOutcome]":
        """Carry a task out in one of the processes; one that takes too long is ended."""
        return self.call(lambda error: broken(task, error), task.limit, _perform, task, self._folder)


def _perform(task: Task, folder: Path) -> TaskOutcome:
    return perform(task, Store(folder))


def broken(task: Task, error: BaseException) -> TaskOutcome:
    """Outcome of a task whose process ended in the middle of it.

    Who takes for ever to answer has failed; a drive that takes so long is the bench's own affair. A user's localiser
    has a process of its own, which breaks no worker.
    """
    if isinstance(error, OutOfTime):
        verdict = Verdict.FAILED if isinstance(task, Question) else Verdict.ERROR
        return TaskOutcome(
            verdict, f"{task.title}: not done within {task.limit:g} s (limits.seconds)", seconds=task.limit
        )
    if isinstance(error, ProcessExpired):
        code = error.exitcode or 0
        how = f"was killed ({signal_name(-code)})" if code < 0 else f"ended with exit code {code}"
        return TaskOutcome(Verdict.ERROR, f"{task.title}: the worker's process {how}")
    return TaskOutcome(Verdict.ERROR, f"{task.title}: {one_line(error)}")
