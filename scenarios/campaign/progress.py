"""Progress of a campaign while it runs: a live table on a terminal, else a line whenever something is done."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from refseq_bench.scenarios.campaign.campaign import Watcher
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.eta import Eta, in_words
from refseq_bench.scenarios.campaign.run.tasks import Task, distinct
from refseq_bench.scenarios.campaign.run.workers import WorkerPool
from refseq_bench.scenarios.heartbeat import Heartbeat
from refseq_bench.scenarios.tables import TextTable

STYLES: Mapping[Verdict, str] = {
    Verdict.PASSED: "green",
    Verdict.FAILED: "red",
    Verdict.ERROR: "magenta",
    Verdict.SKIPPED: "yellow",
}
FRAME = 8
"""Lines of the table that hold no case and no running task."""


class Tally(Watcher):
    """A watcher that counts: what is planned, runs, is done or was kept, and how long the rest will take."""

    def __init__(self, executor: WorkerPool, clock: Callable[[], float] = time.monotonic) -> None:
        self._executor, self._clock, self._pace = executor, clock, Eta()
        self.tasks: dict[str, Task] = {}
        self.cases: dict[str, frozenset[str]] = {}
        self.running: dict[str, float] = {}
        self.outcomes: dict[str, TaskOutcome] = {}
        self.verdicts: dict[str, Verdict] = {}
        self.began = clock()

    def planned(self, tasks: Sequence[Task], cases: Mapping[str, Sequence[Task]]) -> None:
        """Note what is to be done."""
        self.tasks = {task.key: task for task in tasks}
        self.cases = {name: frozenset(task.key for task in distinct(asked)) for name, asked in cases.items()}

    def started(self, task: Task) -> None:
        """Note when."""
        self.running[task.key] = self._clock()

    def ended(self, task: Task, outcome: TaskOutcome) -> None:
        """Note how, and how long it took; what was cut short tells nothing of that."""
        if task.key in self.running and outcome.good:
            self._pace.note(task, self._clock() - self.running[task.key])
        self.running.pop(task.key, None)
        self.outcomes[task.key] = outcome

    def judged(self, result: Judged) -> None:
        """Note the verdict."""
        self.verdicts[result.case.name] = result.verdict

    def close(self) -> None:
        """Nothing."""

    @property
    def kept(self) -> int:
        """Tasks that had been done before."""
        return sum(outcome.kept for outcome in self.outcomes.values())

    @property
    def done(self) -> int:
        """Tasks that were done now."""
        return sum(outcome.good and not outcome.kept for outcome in self.outcomes.values())

    @property
    def left(self) -> float | None:
        """Time that the rest takes [s]; None: nothing is known yet."""
        now = self._clock()
        waiting = [task for key, task in self.tasks.items() if key not in self.outcomes and key not in self.running]
        running = [(self.tasks[key], now - since) for key, since in self.running.items()]
        return self._pace.left(waiting, running, self._executor.workers)

    @property
    def summary(self) -> str:
        """The state of all in one line."""
        left = self.left
        rest = "" if left == 0 else ", time left not known yet" if left is None else f", about {in_words(left)} left"
        return (
            f"{len(self.verdicts)} of {len({*self.cases, *self.verdicts})} cases judged, {len(self.outcomes)} of "
            f"{len(self.tasks)} tasks done, {self.kept} of them kept from before; "
            f"{in_words(self._clock() - self.began)} gone by{rest}"
        )


class ProgressLines(Tally):
    """Says on a console that is no terminal what was done, a line each."""

    def __init__(self, executor: WorkerPool, console: Console) -> None:
        super().__init__(executor)
        self._heartbeat = Heartbeat(console, lambda: self._clock())
        self._told_kept = False

    def ended(self, task: Task, outcome: TaskOutcome) -> None:
        """Say so, of what was not kept from before."""
        super().ended(task, outcome)
        if outcome.kept:
            return
        reason = outcome.reason.removeprefix(f"{task.title}: ")
        state = f"{outcome.seconds:.1f} s" if outcome.good else f"{outcome.verdict.value}: {reason}"
        rest = f"; about {in_words(self.left)} left" if self.left else ""
        self._heartbeat.say(f"[{len(self.outcomes)}/{len(self.tasks)}] {task.title}: {state}{rest}")

    def noted(self, line: str) -> None:
        """Say it."""
        self._heartbeat.say(f"note: {line}")

    def tick(self) -> None:
        """Say once what was kept, and what runs whenever nothing was said for long."""
        if not self._told_kept:
            self._told_kept = True
            self._heartbeat.say(self.summary)
        self._heartbeat.beat(self._under_way)

    def _under_way(self) -> str:
        now = self._clock()
        named = [f"{self.tasks[key].title} for {in_words(now - since)}" for key, since in self.running.items()]
        rest = f"; about {in_words(self.left)} left" if self.left else ""
        return f"[{len(self.outcomes)}/{len(self.tasks)}] {', '.join(named) or 'judging'}{rest}"


class LiveTable(Tally):
    """A table on a terminal that is drawn again and again, and gone at the end: a row a case, a line a running task."""

    def __init__(self, executor: WorkerPool, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(executor, clock)
        self._console = console
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._live.start()

    def noted(self, line: str) -> None:
        """Say it, above the table."""
        self._live.console.print(Text(f"note: {line}"), soft_wrap=True)

    def tick(self) -> None:
        """Draw the table."""
        self._live.update(self.drawn(), refresh=True)

    def close(self) -> None:
        """Take the table away."""
        self._live.stop()

    def drawn(self) -> Group:
        """The table as it is now, no higher than the terminal."""
        room = max(3, self._console.height - FRAME - len(self.running))
        return Group(Text(self.summary), self._table(room), *self._workers())

    def _table(self, room: int) -> TextTable:
        table = TextTable("case", ">tasks", "state")
        shown = list(self._by_interest())
        for name in shown[:room]:
            keys = self.cases[name]
            done = sum(key in self.outcomes for key in keys)
            table.add_row(name, f"{done}/{len(keys)}", self._state(name))
        if len(shown) > room:
            table.add_row(f"and {len(shown) - room} more", "", "")
        return table

    def _by_interest(self) -> Iterable[str]:
        """Cases that are being worked at, then those that wait, then those that are judged, the latest first."""
        left = [name for name in self.cases if name not in self.verdicts]
        yield from sorted(left, key=lambda name: not self.running.keys() & self.cases[name])
        yield from (name for name in reversed(self.verdicts) if name in self.cases)

    def _state(self, name: str) -> Text:
        if verdict := self.verdicts.get(name):
            return Text(verdict.value, STYLES[verdict])
        keys = self.cases[name]
        ended = [self.outcomes[key] for key in keys if key in self.outcomes]
        if bad := next((outcome for outcome in ended if not outcome.good), None):
            return Text(bad.reason, STYLES[bad.verdict], overflow="ellipsis")
        if len(ended) == len(keys):
            return Text("being judged")
        return Text("running") if keys & self.running.keys() else Text("waits", "dim")

    def _workers(self) -> Iterable[Text]:
        now = self._clock()
        for number, (key, since) in enumerate(self.running.items(), 1):
            line = Text(f"{number}: {self.tasks[key].title}, for {in_words(now - since)}", no_wrap=True)
            line.truncate(max(20, self._console.width - 1), overflow="ellipsis")
            yield line


def watcher_on(console: Console, executor: WorkerPool) -> LiveTable | ProgressLines:
    """A watcher that suits a console."""
    return LiveTable(executor, console) if console.is_terminal else ProgressLines(executor, console)
