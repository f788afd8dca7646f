"""Estimate the time that a campaign still takes from the tasks that are done."""

from collections.abc import Iterable
from statistics import fmean

from refseq_bench.scenarios.campaign.run.tasks import Task


class Eta:
    """Notes how long tasks took and estimates the rest."""

    def __init__(self) -> None:
        self._took: dict[str, list[float]] = {}

    def note(self, task: Task, seconds: float) -> None:
        """A task was done in so many seconds."""
        self._took.setdefault(task.kind, []).append(seconds)

    def expected(self, task: Task) -> float | None:
        """Expected duration of a task [s]: the mean of its kind, else of all kinds; None before the first."""
        took = self._took.get(task.kind) or [seconds for kind in self._took.values() for seconds in kind]
        return fmean(took) if took else None

    def left(self, waiting: Iterable[Task], running: Iterable[tuple[Task, float]], workers: int) -> float | None:
        """Time that the rest takes [s]; ``running`` are tasks and the seconds behind each. None: nothing is known yet.

        What is left is shared out among the workers, but one task is never split.
        """
        rest = [self.expected(task) for task in waiting]
        for task, behind in running:
            expected = self.expected(task)
            rest.append(None if expected is None else max(expected - behind, 0.0))
        known = [seconds for seconds in rest if seconds is not None]
        if rest and not known:
            return None
        return max(sum(known) / max(workers, 1), *known, 0.0)


def in_words(seconds: float) -> str:
    """A duration to be read at a glance: 40 s, 12 min, 2 h 05 min."""
    minutes = round(seconds / 60)
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"
