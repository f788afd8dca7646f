import io
import time

import pytest
from rich.console import Console

from refseq_bench.scenarios import heartbeat
from refseq_bench.scenarios.cli.terminal import bars
from refseq_bench.scenarios.cli.terminal.bars import ProgressLog, drive_progress, progress_bar, status_line, step_bars


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    console = Console(file=io.StringIO(), width=40)
    monkeypatch.setattr(bars, "err", console)
    return console.file  # type: ignore[return-value]


def test_piped_each_step_is_a_line_when_it_is_over(piped: io.StringIO) -> None:
    with step_bars() as step:
        drive = step("drive at 16:00")
        assert drive is not None
        drive(3.0, 96.0, 4)
        drive(96.0, 96.0, 113)
        assert piped.getvalue() == ""
        assert step("learn") is None
        assert piped.getvalue() == "drive at 16:00: 96.0 of 96 m, 113 views, 0 s\n"
    assert piped.getvalue().splitlines()[1:] == ["learn: 0 s"]


def test_piped_a_drive_of_unknown_length_tells_how_far_it_came_when_it_is_over(piped: io.StringIO) -> None:
    with progress_bar("hallway at 16:00") as progress:
        progress(0.0, None, 1)
        assert piped.getvalue() == ""
        progress(8.0, None, 11)
    assert piped.getvalue() == "hallway at 16:00: 8.0 m, 11 views, 0 s\n"


def test_piped_a_step_that_fails_is_no_line_of_its_own(piped: io.StringIO) -> None:
    def fail() -> None:
        with progress_bar("hallway at 16:00") as progress:
            progress(3.0, 96.0, 4)
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        fail()
    assert piped.getvalue() == ""


def test_piped_a_long_step_tells_how_it_stands_though_it_says_nothing(
    piped: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(heartbeat, "PERIOD", 0.0)
    with step_bars() as step:
        step("learn")
        with_in_time = time.monotonic() + 20
        while not piped.getvalue() and time.monotonic() < with_in_time:
            time.sleep(0.01)
        assert piped.getvalue().startswith("learn: ")


def test_piped_a_status_is_told_now_and_then(piped: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(heartbeat, "PERIOD", 0.0)
    with status_line("hallway") as tell:
        tell("view 3: [lost]")
        with_in_time = time.monotonic() + 20
        while not piped.getvalue() and time.monotonic() < with_in_time:
            time.sleep(0.01)
    assert piped.getvalue().splitlines()[0] == "hallway, view 3: [lost]"


def test_a_line_of_a_task_has_its_time(piped: io.StringIO) -> None:
    now = 0.0
    console = Console(file=io.StringIO())
    log = ProgressLog(console, lambda: now)
    drive, other = log.add_task("drive", total=1.0, seen=""), log.add_task("learn", total=None, seen="")
    now = 12.4
    drive_progress(log, drive)(40.0, 96.0, 48)
    assert log.state() == "drive: 40.0 of 96 m, 48 views, 12 s; learn: 12 s"
    log.update(drive, total=1, completed=1)
    log.update(other, total=1, completed=1)
    assert log.state() == "at work"
    assert console.file.getvalue().splitlines() == [  # type: ignore[attr-defined]
        "drive: 40.0 of 96 m, 48 views, 12 s", "learn: 12 s",
    ]  # fmt: skip


@pytest.mark.parametrize(("come", "length", "told"), [(48.0, 96.0, "48.0 of 96 m, "), (8.0, None, " 8.0 m, ")])
def test_on_a_terminal_there_are_bars(
    monkeypatch: pytest.MonkeyPatch, come: float, length: float | None, told: str
) -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=100)
    monkeypatch.setattr(bars, "err", console)
    with progress_bar("hallway at 16:00") as progress:
        progress(come, length, 57)
    assert "━" in console.file.getvalue()  # type: ignore[attr-defined]
    assert told in console.file.getvalue()  # type: ignore[attr-defined]
