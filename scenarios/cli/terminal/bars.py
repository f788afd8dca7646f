"""Progress of a command: bars on a terminal, elsewhere a line for each step and one every ten seconds."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rich.console import Console

from refseq_bench.scenarios.cli.terminal.console import err
from refseq_bench.scenarios.heartbeat import Heartbeat

if TYPE_CHECKING:
    from refseq_bench.scenarios.drives.record import Progress

Step = Callable[[str], "Progress | None"]
"""Told the name of each step as it begins; gives back what is to be told of its progress, if anything."""


class Bars(Protocol):
    """Tasks under way, each with a total, if it is known, what is completed of it, and words on it (``seen``)."""

    def add_task(self, description: str, *, total: float | None, seen: str) -> Any:
        """Begin a task; gives its name in ``update``."""

    def update(self, task_id: Any, **changes: Any) -> None:
        """Change ``total``, ``completed`` or ``seen`` of a task; it is over when the former two are equal."""


@contextmanager
def progress_bar(title: str) -> "Iterator[Progress]":
    """A bar for one drive."""
    with shown_bars() as bars:
        task = bars.add_task(title, total=None, seen="")
        yield drive_progress(bars, task)
        bars.update(task, total=1, completed=1)


@contextmanager
def step_bars() -> "Iterator[Step]":
    """A line for each step, with a bar where it drives."""
    with shown_bars() as bars:
        running: list[Any] = []

        def finish() -> None:
            for task in running:
                bars.update(task, total=1, completed=1)
            running.clear()

        def step(name: str) -> "Progress | None":
            finish()
            running.append(bars.add_task(name, total=None, seen=""))
            return drive_progress(bars, running[-1]) if name.startswith("drive") else None

        yield step
        finish()


def drive_progress(bars: Bars, task: Any) -> "Progress":
    """A callback that fills a bar as the robot comes along its route, and tells how far it is where it has none."""

    def show(progress: float, length: float | None, views: int) -> None:
        if length is None:
            bars.update(task, seen=f"{progress:5.1f} m, {views:3d} views")
            return
        # The last metre is full only when the drive is over: 'progress' may come close to it before.
        done = min(progress, length * (1 - 1e-9))
        bars.update(task, total=length, completed=done, seen=f"{progress:5.1f} of {length:.0f} m, {views:3d} views")

    return show


@contextmanager
def status_line(title: str) -> Iterator[Callable[[str], None]]:
    """A line on the terminal that tells how something stands, until it is over."""
    from rich.markup import escape

    if err.is_terminal:
        with err.status(escape(title)) as line:
            yield lambda text: line.update(escape(f"{title}, {text}"))
        return
    told = [title]
    with _beating(Heartbeat(err), lambda: told[0]):
        yield lambda text: told.__setitem__(0, f"{title}, {text}")


@contextmanager
def shown_bars() -> Iterator[Bars]:
    """Bars on a terminal, which vanish when what they show fails: that is told in a line of its own. Else lines."""
    if not err.is_terminal:
        lines = ProgressLog(err)
        with _beating(lines.heartbeat, lines.state):
            yield lines
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:<24}", markup=False),
        BarColumn(24),
        TextColumn("{task.fields[seen]:<24}"),
        TimeElapsedColumn(),
    )
    bars = Progress(*columns, console=err)
    bars.start()
    try:
        yield bars
    except BaseException:
        bars.live.transient = True
        bars.live.stop()
        raise
    bars.stop()


@dataclass(slots=True)
class _LoggedTask:
    name: str
    began: float
    total: float | None
    completed: float = 0.0
    seen: str = ""
    over: bool = False

    def line(self, now: float) -> str:
        words = [" ".join(self.seen.split()), f"{now - self.began:.0f} s"]
        return f"{self.name}: {', '.join(filter(None, words))}"


class ProgressLog:
    """Stands for bars where nobody sees them move: a line when a task is over, and how it stands now and then."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self.heartbeat, self._clock = Heartbeat(console, clock), clock
        self._tasks: list[_LoggedTask] = []

    def add_task(self, description: str, *, total: float | None, seen: str) -> int:
        """See ``Bars``."""
        self._tasks.append(_LoggedTask(description, self._clock(), total, seen=seen))
        return len(self._tasks) - 1

    def update(self, task_id: int, **changes: Any) -> None:
        """See ``Bars``."""
        task = self._tasks[task_id]
        for name, value in changes.items():
            setattr(task, name, value)
        if task.total is not None and task.completed >= task.total and not task.over:
            task.over = True
            self.heartbeat.say(task.line(self._clock()))

    def state(self) -> str:
        """Tasks under way, in one line."""
        now = self._clock()
        return "; ".join(task.line(now) for task in self._tasks if not task.over) or "at work"


@contextmanager
def _beating(heartbeat: Heartbeat, state: Callable[[], str]) -> Iterator[None]:
    """Give signs of life from a thread of its own: a step may be silent for long."""
    ended = threading.Event()

    def beat() -> None:
        while not ended.wait(0.5):
            heartbeat.beat(state)

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
