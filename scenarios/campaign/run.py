"""Running a campaign: the tasks of all cases in an order in which they can be done, and each case judged as it is done.

What is in the store is not done again, so that a campaign which was interrupted goes on where it was.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Protocol

from scenarios.campaign.cases import Case
from scenarios.campaign.judging import Judged, judged, tasks_of
from scenarios.campaign.outcomes import Outcome, Verdict
from scenarios.campaign.sources import AbsentError
from scenarios.campaign.store import Store
from scenarios.campaign.tasks import AnswerTask, Task, distinct
from scenarios.campaign.workers import Executor

TICK = 0.25
"""How often a watcher is told that time goes by [s]."""


class Watcher(Protocol):
    """Is told how a campaign goes."""

    def planned(self, tasks: Sequence[Task], cases: Mapping[str, Sequence[Task]]) -> None:
        """All tasks, and those that each case waits for."""

    def started(self, task: Task) -> None:
        """A task was handed to a worker."""

    def ended(self, task: Task, outcome: Outcome) -> None:
        """A task has ended."""

    def judged(self, result: Judged) -> None:
        """A case has its verdict."""

    def tick(self) -> None:
        """Time goes by."""


class Quiet:
    """A watcher that says nothing."""

    def planned(self, tasks: Sequence[Task], cases: Mapping[str, Sequence[Task]]) -> None:
        """Nothing."""

    def started(self, task: Task) -> None:
        """Nothing."""

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing."""

    def judged(self, result: Judged) -> None:
        """Nothing."""

    def tick(self) -> None:
        """Nothing."""


def run_campaign(cases: Sequence[Case], executor: Executor, store: Store, watcher: Watcher) -> Iterator[Judged]:
    """Run some cases; yields each as it is judged.

    A task that cannot be done stops what needs it, and nothing else.
    """
    plans: dict[str, dict[int, list[AnswerTask]]] = {}
    for case in cases:
        try:
            plans[case.name] = tasks_of(case)
        except AbsentError as absent:
            yield _skipped(case, str(absent))
    questions = {name: [task for of_seed in plan.values() for task in of_seed] for name, plan in plans.items()}
    tasks = distinct([task for asked in questions.values() for task in asked])
    watcher.planned(tasks, questions)
    left = [case for case in cases if case.name in plans]
    outcomes: dict[str, Outcome] = {}
    for _ in _carried_out(tasks, outcomes, executor, store, watcher):
        ready = [case for case in left if all(task.key in outcomes for task in questions[case.name])]
        for case in ready:
            left.remove(case)
            result = judged(case, plans[case.name], outcomes, store)
            watcher.judged(result)
            yield result


def _skipped(case: Case, reason: str) -> Judged:
    return Judged(case, Verdict.SKIPPED, (reason,), (), (), (), {}, {}, 0.0)


@dataclass
class _Queue:
    """Tasks that wait for others, and those that run."""

    waiting: list[Task]
    running: dict["Future[Outcome]", Task] = field(default_factory=dict)

    def ready(self, outcomes: Mapping[str, Outcome]) -> list[Task]:
        """Take out the tasks whose needs have ended."""
        found = [task for task in self.waiting if all(need.key in outcomes for need in task.needs)]
        self.waiting = [task for task in self.waiting if task not in found]
        return found


def _carried_out(
    tasks: Sequence[Task], outcomes: dict[str, Outcome], executor: Executor, store: Store, watcher: Watcher
) -> Iterator[None]:
    """Have tasks carried out, and put their outcomes in ``outcomes``; yields whenever some have ended."""
    queue = _Queue(list(tasks))

    def ended(task: Task, outcome: Outcome) -> None:
        outcomes[task.key] = outcome
        watcher.ended(task, outcome)

    while queue.waiting or queue.running:
        for task in queue.ready(outcomes):
            if store.has(task.key, task.ending):
                ended(task, Outcome(Verdict.PASSED, kept=True))
            elif failed := next((outcomes[n.key] for n in task.needs if not outcomes[n.key].good), None):
                ended(task, failed)
            else:
                watcher.started(task)
                queue.running[executor.submit(task)] = task
        done, _ = wait(queue.running, timeout=TICK, return_when=FIRST_COMPLETED)
        for future in done:
            ended(queue.running.pop(future), future.result())
        watcher.tick()
        yield
