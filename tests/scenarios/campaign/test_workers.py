"""Processes of one's own: what breaks in one breaks nothing else. One campaign with all that can go wrong."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import TimeoutError as OutOfTime
from pathlib import Path

import pytest

from scenarios.campaign.outcomes import Outcome, Verdict
from scenarios.campaign.sources import Log
from scenarios.campaign.store import ANSWERS, Store
from scenarios.campaign.tasks import AnswerTask
from scenarios.campaign.workers import LocalWorkers, broken
from tests.scenarios.campaign.chores import Chore

DOES = ("tell", "die", "raise", "hang")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def outcomes(store: Store) -> Iterator[dict[str, Outcome]]:
    """How tasks ended that were given to two processes."""
    workers = LocalWorkers(2, store.folder)
    chores = [Chore(f"one-{does}", does, limit=1.0 if does == "hang" else 600) for does in DOES]
    futures = {chore.key: workers.submit(chore) for chore in (*chores, Chore("last"))}
    yield {key: future.result(120) for key, future in futures.items()}
    workers.close(at_once=False)


def test_what_goes_well_goes_on_whatever_breaks_beside_it(outcomes: dict[str, Outcome], store: Store) -> None:
    for key in ("one-tell", "last"):
        assert outcomes[key].good
        assert store.has(key, ANSWERS)


@pytest.mark.parametrize(
    ("does", "reason"),
    [
        ("die", "the worker's process was killed (SIGKILL)"),
        ("hang", "not done within 1 s (limits.seconds)"),
        ("raise", "ValueError: in two lines"),
    ],
)
def test_what_breaks_is_told_in_one_line(outcomes: dict[str, Outcome], store: Store, does: str, reason: str) -> None:
    key = f"one-{does}"
    assert outcomes[key].verdict is Verdict.ERROR
    assert outcomes[key].reason == f"{does} {key}: {reason}"
    assert not store.path(key, ANSWERS).exists()


def test_only_an_unforeseen_error_has_a_trace(outcomes: dict[str, Outcome]) -> None:
    assert "carry_out" in outcomes["one-raise"].details
    assert not outcomes["one-die"].details


def test_a_process_has_one_thread_for_sums_and_its_share_for_images(outcomes: dict[str, Outcome], store: Store) -> None:
    told = store.path("one-tell", ANSWERS).read_text().split(maxsplit=2)
    cores = max(1, len(os.sched_getaffinity(0)) // 2)
    assert int(told[1]) != os.getpid()
    assert told[2] == f"['1', '1'] {cores} PAR1"


def test_drafts_of_killed_processes_are_swept(outcomes: dict[str, Outcome], store: Store) -> None:
    store.sweep()
    assert not list(store.folder.glob(".draft-*"))
    assert outcomes


def test_a_method_that_hangs_has_failed_and_a_drive_that_hangs_is_an_error() -> None:
    log = Log("any.log")
    question = AnswerTask(("mine:Slow",), log, log, None, None, 1, 60.0)
    assert broken(question, OutOfTime()) == Outcome(
        Verdict.FAILED, "ask mine:Slow, seed 1: not done within 60 s (limits.seconds)", seconds=60.0
    )
    assert broken(Chore("a", limit=60), OutOfTime()).verdict is Verdict.ERROR


def test_stopping_ends_what_hangs_within_seconds(store: Store) -> None:
    others = set(multiprocessing.active_children())
    workers = LocalWorkers(1, store.folder)
    workers.submit(Chore("forever", "hang"))
    wait_for(lambda: bool(list(store.folder.glob(".draft-*/*"))))
    begin = time.monotonic()
    workers.close(at_once=True)
    assert time.monotonic() - begin < 5
    assert set(multiprocessing.active_children()) <= others
    store.sweep()
    assert not list(store.folder.glob(".draft-*"))


def test_workers_die_with_their_master(tmp_path: Path) -> None:
    script = (
        "from pathlib import Path; from scenarios.campaign.workers import LocalWorkers; "
        "from tests.scenarios.campaign.chores import Chore; "
        f"LocalWorkers(1, Path({str(tmp_path)!r})).submit(Chore('forever', 'hang')).result()"
    )
    root = Path(__file__).parents[3]
    master = subprocess.Popen([sys.executable, "-c", script], cwd=root, start_new_session=True)
    try:
        wait_for(lambda: bool(list(tmp_path.glob(".draft-*/*"))))
        master.send_signal(signal.SIGKILL)
        master.wait()
        wait_for(lambda: not alive(master.pid), 5)
    finally:
        if alive(master.pid):
            os.killpg(master.pid, signal.SIGKILL)


def alive(group: int) -> bool:
    """Whether a process of the group is left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(condition: object, seconds: float = 60.0) -> None:
    assert callable(condition)
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
