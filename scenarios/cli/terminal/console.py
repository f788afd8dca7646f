"""Output of the commands on the terminal: lines, the table of results, bars."""

import json
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from refseq.files import replacing_at
from refseq_bench.scenarios.drives.inputs import check_output, writing
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from refseq_bench.scenarios.drives.evaluate import StageResult
    from refseq_bench.scenarios.drives.record import Progress
    from refseq_bench.scenarios.scoring.comparison import Comparison
    from refseq_bench.scenarios.scoring.proportion import Proportion

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

Step = Callable[[str], "Progress | None"]
"""Told the name of each step as it begins; gives back what is to be told of its progress, if anything."""

out, err = Console(), Console(stderr=True)

WITHOUT_TRUTH = (
    "jumps are steps that odometry does not allow, the slope is 1 for answers that go along with the robot, and others "
    "agree within 1.5 m along the map"
)
"""Explains the table of what needs no truth, in a line."""


class Notes(logging.Handler):
    """Print warnings of the library as notes."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        say(err, f"note: {record.getMessage()}")


def print_json(value: object) -> None:
    """Print a value for other programs: dataclasses as tables, NaN and the like as null."""
    print(json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False), file=out.file)


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: _plain(getattr(value, one.name)) for one in fields(value)}
    if hasattr(value, "model_dump"):
        return _plain(value.model_dump(mode="json"))
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, str | Path):
        return str(value)
    if isinstance(value, Iterable):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def saved(path: Path, about: str = "", *, quiet: bool = False) -> Iterator[Path]:
    """Write a file, the whole of it or nothing, under the name that is given here, and say so."""
    check_output(path)
    with writing(path), replacing_at(path) as temporary:
        yield temporary
    if not quiet:
        say(out, f"{path}: {about}" if about else f"{path}")


@contextmanager
def wrote(path: Path, *, quiet: bool = False) -> Iterator[None]:
    """Say that a file was written, or in one line what kept it from being."""
    with writing(path):
        yield
    if not quiet:
        say(out, f"{path}")


def print_results(title: str, found: "Sequence[StageResult]", comparisons: "Sequence[Comparison]") -> None:
    """The table of the stages, with the number of views and 95 % intervals."""
    from refseq_bench.scenarios.scoring.tables import NONE, consistency_table
    from refseq_bench.scenarios.scoring.truth import unscored_reason
    from refseq_bench.scenarios.tables import TextTable, print_whole

    views = sum(len(comparison.query_views) for comparison in comparisons)
    runs = f"{len(comparisons)} drives, " if len(comparisons) > 1 else ""
    tolerances = list(found[0].success) if found else []
    within = [f">within {tolerance.label} [95 %]" for tolerance in tolerances]
    table = TextTable("stage", *within, ">failures", ">lost", title=f"{title}: {runs}{views} views")
    for result in found:
        shares = [share_of(result.success[tolerance]) for tolerance in tolerances]
        failures = NONE if result.failures is None else str(result.failures)
        table.add_row(result.stage.value, *shares, failures, str(result.lost))
    out.print(table)
    if unscored := unscored_reason(comparisons):
        print_whole(out, consistency_table("stage", [(one.stage.value, one.consistency) for one in found]))
        say(out, f"not scored: {unscored}")
        say(out, WITHOUT_TRUTH)
    elif found and not any(result.success[tolerances[0]].trials for result in found):
        say(out, "no view has a true pose on the map: nothing to score")


def share_of(share: "Proportion") -> str:
    """A share with the number of views."""
    return f"{share} of {share.trials}" if share.trials else str(share)


def leave_below(found: "Sequence[StageResult]", at_least: float | None) -> None:
    """Leave with 1 when the last stage is right less often than asked [%]."""
    if at_least is None or not found:
        return
    success = next(iter(found[-1].success.values()))
    if not success.trials or 100 * success.value < at_least:
        say(err, f"below what was asked: {share_of(success)}, at least {at_least:g} %")
        raise typer.Exit(1)


@contextmanager
def status_line(title: str) -> Iterator[Callable[[str], None]]:
    """A line on the terminal that tells how something stands, until it is over."""
    from rich.markup import escape

    with err.status(escape(title)) as line:
        yield lambda text: line.update(escape(f"{title}, {text}"))


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
    """A callback that fills a bar as the robot comes along its route."""

    def show(progress: float, length: float, views: int) -> None:
        bars.update(task, total=length, completed=progress, seen=f"{progress:5.1f} of {length:.0f} m, {views:3d} views")

    return show
