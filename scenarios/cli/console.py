"""What the commands show on the terminal: lines, the table of results, bars."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console

from scenarios.tables import say as say

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from scenarios.cli.demo import Step
    from scenarios.drives.evaluate import StageResult
    from scenarios.drives.record import Progress
    from scenarios.scoring.comparison import Comparison
    from scenarios.scoring.proportion import Proportion

__all__ = [
    "bars_on_terminal",
    "drive_progress",
    "err",
    "out",
    "print_results",
    "progress_bar",
    "say",
    "share_of",
    "step_bars",
]

out, err = Console(), Console(stderr=True)


class Notes(logging.Handler):
    """Print warnings of the library as notes."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        say(err, f"note: {record.getMessage()}")


def print_results(title: str, found: "Sequence[StageResult]", comparisons: "Sequence[Comparison]") -> None:
    """The table of the stages, with the number of views and 95 % intervals."""
    from scenarios.tables import TextTable

    views = sum(len(comparison.query_views) for comparison in comparisons)
    runs = f"{len(comparisons)} drives, " if len(comparisons) > 1 else ""
    tolerances = list(found[0].success) if found else []
    within = [f">within {tolerance.distance:g} m [95 %]" for tolerance in tolerances]
    table = TextTable("stage", *within, ">failures", ">lost", title=f"{title}: {runs}{views} views")
    for result in found:
        shares = [share_of(result.success[tolerance]) for tolerance in tolerances]
        table.add_row(result.stage.value, *shares, str(result.failures), str(result.lost))
    out.print(table)
    if found and not any(result.success[tolerances[0]].trials for result in found):
        say(out, "no view has a true pose on the map: nothing to score")


def share_of(share: "Proportion") -> str:
    """A share with the number of views."""
    return f"{share} of {share.trials}" if share.trials else str(share)


@contextmanager
def progress_bar(title: str) -> "Iterator[Progress]":
    """A bar for one drive."""
    with bars_on_terminal() as bars:
        task = bars.add_task(title, total=1.0, seen="")
        yield drive_progress(bars, task)
        bars.update(task, total=1, completed=1)


@contextmanager
def step_bars() -> "Iterator[Step]":
    """A line for each step, with a bar where it drives."""
    with bars_on_terminal() as bars:
        running: list[TaskID] = []

        def finish() -> None:
            for task in running:
                bars.update(task, total=1, completed=1)
            running.clear()

        def step(name: str) -> "Progress | None":
            finish()
            running.append(bars.add_task(name, total=1.0 if name.startswith("drive") else None, seen=""))
            return drive_progress(bars, running[-1]) if name.startswith("drive") else None

        yield step
        finish()


@contextmanager
def bars_on_terminal() -> "Iterator[Bars]":
    """Bars on the terminal; they vanish when what they show fails, which is told in a line of its own."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (
        TextColumn("{task.description:<24}", markup=False),
        BarColumn(24),
        TextColumn("{task.fields[seen]:<24}"),
        TimeElapsedColumn(),
    )
    bars = Bars(*columns, console=err)
    bars.start()
    try:
        yield bars
    except BaseException:
        bars.live.transient = True
        bars.live.stop()
        raise
    bars.stop()


def drive_progress(bars: "Bars", task: "TaskID") -> "Progress":
    """What fills a bar as the robot comes along its route."""

    def show(progress: float, length: float, views: int) -> None:
        bars.update(task, total=length, completed=progress, seen=f"{progress:5.1f} of {length:.0f} m, {views:3d} views")

    return show
