import io
from types import SimpleNamespace
from typing import cast

import pytest
from rich.console import Console

from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.progress import LiveTable, ProgressLines, Tally, watcher_on
from refseq_bench.scenarios.campaign.run.workers import WorkerPool
from tests.scenarios.campaign.chores import Chore

TWO = cast(WorkerPool, SimpleNamespace(workers=2))
DRIVES = [Chore(f"drive-{n}", "drive") for n in range(2)]
ASKS = [Chore(f"ask-{n}", "ask", (drive,)) for n, drive in enumerate(DRIVES)]
TASKS = [DRIVES[0], ASKS[0], DRIVES[1], ASKS[1]]
CASES = {"first": [ASKS[0]], "second": [ASKS[0], ASKS[1]]}
PASSED, KEPT = TaskOutcome(Verdict.PASSED, seconds=10), TaskOutcome(Verdict.PASSED, kept=True)


def verdict_on(name: str, verdict: Verdict = Verdict.PASSED) -> Judged:
    return cast(Judged, SimpleNamespace(case=SimpleNamespace(name=name), verdict=verdict))


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def half_way(watcher: Tally, clock: Clock) -> None:
    """The first drive was kept, the first question took 10 s, the second drive runs for 4 s."""
    watcher.planned(TASKS, CASES)
    watcher.ended(DRIVES[0], KEPT)
    watcher.started(ASKS[0])
    clock.now += 10
    watcher.ended(ASKS[0], PASSED)
    watcher.judged(verdict_on("first"))
    watcher.started(DRIVES[1])
    clock.now += 4


def test_the_tally_tells_what_is_done_kept_and_left() -> None:
    clock = Clock()
    tally = Tally(TWO, clock)
    half_way(tally, clock)
    assert (tally.done, tally.kept) == (1, 1)
    # A drive is expected to take as long as the question did: 6 s of one, 10 s of the other, two workers; but no
    # question is split.
    assert tally.left == pytest.approx(10)
    assert tally.summary == (
        "1 of 2 cases judged, 2 of 4 tasks done, 1 of them kept from before; 14 s gone by, about 10 s left"
    )


def test_what_is_kept_or_fails_does_not_hurry_the_estimate() -> None:
    clock = Clock()
    tally = Tally(TWO, clock)
    half_way(tally, clock)
    tally.ended(DRIVES[1], TaskOutcome(Verdict.ERROR, "broken", seconds=0.1))
    assert tally.left == pytest.approx(10)


def text_of(table: LiveTable, width: int = 100, height: int = 30) -> str:
    console = Console(file=io.StringIO(), width=width, height=height, force_terminal=True, color_system=None)
    console.print(table.drawn())
    return cast(io.StringIO, console.file).getvalue()


def live_table(width: int = 100, height: int = 30) -> tuple[LiveTable, Clock, Console]:
    console = Console(file=io.StringIO(), force_terminal=True, width=width, height=height)
    clock = Clock()
    return LiveTable(TWO, console, clock), clock, console


def test_the_table_shows_cases_with_their_state_and_what_runs() -> None:
    table, clock, _ = live_table()
    half_way(table, clock)
    lines = [line.split() for line in text_of(table).splitlines()]
    table.close()
    assert ["first", "2/2", "passed"] in lines
    assert ["second", "2/4", "running"] in lines
    assert lines.index(["second", "2/4", "running"]) < lines.index(["first", "2/2", "passed"])
    assert ["1:", "drive", "drive-1,", "for", "4", "s"] in lines


@pytest.mark.parametrize(("width", "height"), [(40, 10), (80, 24), (200, 50)])
def test_the_table_is_no_higher_than_the_terminal(width: int, height: int) -> None:
    table, _, _ = live_table(width, height)
    many = {f"case-{n}": [Chore(f"task-{n}")] for n in range(200)}
    table.planned([chore for chores in many.values() for chore in chores], many)
    for n in range(2):
        table.started(many[f"case-{n}"][0])
    lines = text_of(table, width, height).splitlines()
    table.close()
    assert len(lines) <= max(height, 14)
    assert any("more" in line for line in lines)
    assert max(map(len, lines)) <= width


def test_a_mishap_is_seen_where_it_happened() -> None:
    table, clock, _ = live_table()
    half_way(table, clock)
    table.ended(DRIVES[1], TaskOutcome(Verdict.ERROR, "the disk [red]is full"))
    assert "the disk [red]is full" in text_of(table)
    table.close()


def test_the_table_is_gone_at_the_end_and_notes_stay() -> None:
    table, clock, console = live_table()
    half_way(table, clock)
    table.tick()
    table.noted("drive.mcap: is cut off or damaged; it is made anew")
    table.close()
    written = cast(io.StringIO, console.file).getvalue()
    assert "note: drive.mcap: is cut off or damaged; it is made anew" in written
    assert written.rstrip().endswith(("\x1b[2K", "\x1b[?25h"))  # the last line is cleared, the cursor is back


def test_without_a_terminal_each_task_is_a_line() -> None:
    console = Console(file=io.StringIO(), width=40)
    watcher = watcher_on(console, TWO)
    assert isinstance(watcher, ProgressLines)
    clock = Clock()
    watcher._clock = clock
    half_way(watcher, clock)
    watcher.noted("one thing")
    watcher.ended(DRIVES[1], TaskOutcome(Verdict.FAILED, "drive drive-1: stuck at 3 m"))
    assert cast(io.StringIO, console.file).getvalue().splitlines() == [
        "[2/4] ask ask-0: 10.0 s; about 10 s left",
        "note: one thing",
        "[3/4] drive drive-1: failed: stuck at 3 m; about 10 s left",
    ]


def test_without_a_terminal_what_runs_is_told_every_ten_seconds() -> None:
    console = Console(file=io.StringIO(), width=40)
    clock = Clock()
    watcher = ProgressLines(TWO, console)
    watcher._clock = clock
    half_way(watcher, clock)
    for _ in range(25):
        clock.now += 1
        watcher.tick()
    said = [line.split(";")[0] for line in cast(io.StringIO, console.file).getvalue().splitlines()[1:]]
    assert said[0].startswith("1 of 2 cases judged, 2 of 4 tasks done")
    assert said[1:] == ["[2/4] drive drive-1 for 15 s", "[2/4] drive drive-1 for 25 s"]


def test_on_a_terminal_it_is_the_table() -> None:
    watcher = watcher_on(Console(file=io.StringIO(), force_terminal=True), TWO)
    watcher.close()
    assert isinstance(watcher, LiveTable)
