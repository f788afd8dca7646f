"""Running a campaign: the tasks of all cases in an order in which they can be done, and each case judged as it is done.

What is in the store is not done again, so that a campaign which was interrupted goes on where it was. What the store
holds but cannot be read is made anew, once.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeGuard

from refseq.errors import RefseqError
from refseq_bench.scenarios.campaign.aside import aside
from refseq_bench.scenarios.campaign.case_types import judged
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict, one_line
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.case_tasks import tasks_of
from refseq_bench.scenarios.campaign.run.tasks import Question, Task, distinct
from refseq_bench.scenarios.campaign.run.workers import WorkerPool
from refseq_bench.scenarios.campaign.store.cache import DamagedError, Store
from refseq_bench.scenarios.errors import ScenarioError, UnwritableError

TICK = 0.25
"""Period in which a watcher is told that time goes by [s]."""
PATIENCE = 10.0
"""Whoever leaves waits so long for a page that is being written [s]: a page takes less, judging may take more."""


class Watcher:
    """Is told how a campaign goes; this one does nothing about it."""

    def planned(self, tasks: Sequence[Task], cases: Mapping[str, Sequence[Task]]) -> None:
        """All tasks, and those that each case waits for."""

    def started(self, task: Task) -> None:
        """A worker has begun with a task."""

    def ended(self, task: Task, outcome: TaskOutcome) -> None:
        """A task has ended."""

    def noted(self, line: str) -> None:
        """Something that the user should know."""

    def judged(self, result: Judged) -> None:
        """A case has its verdict."""

    def tick(self) -> None:
        """Time goes by."""


Conclude = Callable[[Judged], None]


def leave_it(_result: Judged) -> None:
    """Nothing is done with a verdict but to yield it."""


def run_campaign(
    cases: Sequence[Case],
    executor: WorkerPool,
    store: Store,
    watcher: Watcher,
    *,
    fresh: bool = False,
    conclude: Conclude = leave_it,
) -> Iterator[Judged]:
    """Run some cases; yields each as it is judged.

    A task that cannot be done stops what needs it, and nothing else. ``fresh`` asks all questions anew, and has maps
    learnt anew, each once; recordings are taken from the store as ever. ``conclude`` is what is to be done with each
    verdict before it is yielded; it is called in a thread of its own, so that nobody waits for the pages that it
    writes. ``UnwritableError`` of it ends the campaign; anything else that it raises, but ``DamagedError``, is an error
    of its case, which is concluded as that.
    """
    with suppress(OSError):  # a store that may only be read is as good, as long as nothing is missing in it
        store.sweep()
    plans: dict[str, _Plan] = {}
    for case in cases:
        try:
            plans[case.name] = _plan(case)
        except AbsentError as absent:
            result = _without_answers(case, Verdict.SKIPPED, str(absent))
            result = _through(conclude, result)
            watcher.judged(result)
            yield result
    yield from _Campaign(plans, executor, store, watcher, fresh, conclude).run()


def _through(conclude: Conclude, result: Judged) -> Judged:
    """The verdict that was concluded: the one given, or an error where its page cannot be drawn.

    Raises ``DamagedError`` and ``UnwritableError``.
    """
    for _ in ("the page", "one that tells of the error alone"):
        try:
            conclude(result)
            break
        except (DamagedError, UnwritableError):
            raise
        except Exception as error:
            result = _without_answers(result.case, Verdict.ERROR, f"its page: {one_line(error)}")
    return result


def _without_answers(case: Case, verdict: Verdict, reason: str) -> Judged:
    return Judged(case, verdict, (reason,), (), (), (), {}, {}, 0.0)


@dataclass(frozen=True)
class _Plan:
    """A case, its questions by seed, and the ``keys`` of all that must have ended before it is judged."""

    case: Case
    questions: Mapping[int, Sequence[Question]]
    keys: frozenset[str]

    @property
    def asked(self) -> list[Question]:
        """All questions."""
        return _all_of(self.questions)


def _plan(case: Case) -> _Plan:
    """The plan of a case. Raises ``AbsentError``: for its keys real recordings have to be there."""
    questions = tasks_of(case)
    return _Plan(case, questions, frozenset(one.key for one in distinct(_all_of(questions))))


def _all_of(questions: Mapping[int, Sequence[Question]]) -> list[Question]:
    return [task for of_seed in questions.values() for task in of_seed]


class _Campaign:
    """The state of a campaign: what waits, what runs, how what is done has ended, which cases have no verdict yet."""

    def __init__(
        self,
        plans: Mapping[str, _Plan],
        executor: WorkerPool,
        store: Store,
        watcher: Watcher,
        fresh: bool,
        conclude: Conclude,
    ) -> None:
        self._executor, self._store, self._watcher = executor, store, watcher
        self._fresh, self._conclude = fresh, conclude
        self._open = dict(plans)
        self._keys = {name: plan.keys for name, plan in plans.items()}
        self._tasks = {task.key: task for task in distinct([task for plan in plans.values() for task in plan.asked])}
        self._waiting = list(self._tasks.values())
        self._running: dict[Future[TaskOutcome], Task] = {}
        self._judging: dict[Future[Judged], _Plan] = {}
        self._deserted = self._leaving = False
        self._outcomes: dict[str, TaskOutcome] = {}
        self._missing: set[str] = set()
        self._discarded: set[str] = set()
        self._renewed: set[str] = set()
        self._repeated: set[str] = set()
        watcher.planned(self._waiting, {name: plan.asked for name, plan in plans.items()})

    def run(self) -> Iterator[Judged]:
        """Have everything done; yields the cases in the order in which they are judged.

        Whoever leaves before waits a while for the page that is being written; none is begun then.
        """
        try:
            yield from self._all_judged()
        except BaseException:
            self._leaving = True
            wait(self._judging, timeout=PATIENCE)
            raise

    def _all_judged(self) -> Iterator[Judged]:
        while self._open or self._judging:
            self._begin()
            # One at a time: whole drives are in memory meanwhile, and what one finds damaged the next may need.
            if not self._judging and (plan := self._complete()):
                self._judging[aside(partial(self._judged, plan))] = plan
            done = _some_of((*self._running, *self._judging))
            for future in done & self._running.keys():
                self._end(self._running.pop(future), future.result())
            for future in done & self._judging.keys():
                yield from self._concluded(self._judging.pop(future), future)
            self._tell_of_workers()
            self._watcher.tick()

    # --- tasks ---

    def _begin(self) -> None:
        """Hand out tasks that nothing holds up, the first cases' first, one a worker.

        A worker never has a queue of its own, so that answers come as soon as they can, not after the last drive. In
        the store each is looked for as soon as nothing holds it up, and again, as others may make it, when its turn has
        come: thousands wait.
        """
        for task in list(self._waiting):
            needs = [self._outcomes.get(need.key) for need in task.needs]
            if None in needs:
                continue
            free = len(self._running) < self._executor.workers
            if (free or task.key not in self._missing) and self._kept(task):
                self._end(task, TaskOutcome(Verdict.PASSED, kept=True))
            elif failed := next((need for need in needs if need and not need.good), None):
                self._end(task, failed)
            elif free:
                self._hand_out(task)
                continue
            else:
                self._missing.add(task.key)
                continue
            self._waiting.remove(task)

    def _tell_of_workers(self) -> None:
        """Say when the last worker is lost, and when there are some again."""
        deserted = self._executor.workers == 0
        if deserted is not self._deserted:
            self._deserted = deserted
            self._watcher.noted("there is no worker; the campaign waits for one" if deserted else "there are workers")

    def _hand_out(self, task: Task) -> None:
        if self._is_fresh(task):
            for key in {task.key, *task.maps} - self._discarded:  # a map that others share is learnt once
                self._store.discard(key)
                self._discarded.add(key)
        self._waiting.remove(task)
        self._watcher.started(task)
        self._running[self._executor.submit(task)] = task

    def _is_fresh(self, task: Task) -> TypeGuard[Question]:
        return self._fresh and isinstance(task, Question)

    def _kept(self, task: Task) -> bool:
        """Return true where the task's file is whole in the store; note one that is cut off."""
        if self._is_fresh(task):
            return False
        if self._store.has(task.key, task.ending):
            return True
        path = self._store.path(task.key, task.ending)
        if path.exists() and task.key not in self._renewed:
            self._renewed.add(task.key)
            self._watcher.noted(f"{path}: is cut off or damaged; it is made anew")
        return False

    def _end(self, task: Task, outcome: TaskOutcome) -> None:
        if outcome.damaged and task.key not in self._repeated:
            self._repeated.add(task.key)
            self._renew(outcome.damaged, outcome.reason)
            self._waiting.insert(0, task)
            return
        self._outcomes[task.key] = outcome
        self._watcher.ended(task, outcome)

    def _renew(self, key: str, reason: str) -> bool:
        """Have a damaged file made anew; False where it was already, to no avail."""
        if key not in self._outcomes:
            return True  # others have met it before, and it is being made
        if key in self._renewed:
            return False
        self._renewed.add(key)
        self._watcher.noted(f"{reason}; it is made anew")
        self._store.discard(key)
        del self._outcomes[key]
        self._waiting.insert(0, self._tasks[key])
        return True

    # --- cases ---

    def _complete(self) -> _Plan | None:
        """Take out the first case of which all has ended."""
        name = next((name for name in self._open if self._keys[name] <= self._outcomes.keys()), None)
        return None if name is None else self._open.pop(name)

    def _judged(self, plan: _Plan) -> Judged:
        """The verdict, after all that is to be done with it. Raises ``DamagedError``."""
        try:
            result = judged(plan.case, plan.questions, self._outcomes, self._store)
        except DamagedError:
            raise
        except (ScenarioError, RefseqError) as error:
            result = _without_answers(plan.case, Verdict.ERROR, f"judging: {error}")
        except Exception as error:
            result = _without_answers(plan.case, Verdict.ERROR, f"judging: {one_line(error)}")
        return result if self._leaving else _through(self._conclude, result)

    def _concluded(self, plan: _Plan, future: "Future[Judged]") -> Iterator[Judged]:
        """The verdict, or none yet where something that it needs was damaged and is made anew."""
        try:
            result = future.result()
        except DamagedError as damaged:
            if self._renew(damaged.key, damaged.reason):
                self._open[plan.case.name] = plan
                return
            result = _through(self._conclude, _without_answers(plan.case, Verdict.ERROR, damaged.reason))
        self._watcher.judged(result)
        yield result


def _some_of(futures: "Sequence[Future[Any]]") -> "set[Future[Any]]":
    """Those that are done, after a tick at most; without any, time goes by all the same."""
    if not futures:
        time.sleep(TICK)
    return wait(futures, timeout=TICK, return_when=FIRST_COMPLETED).done
