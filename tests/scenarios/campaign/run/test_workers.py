"""Processes of one's own: what breaks in one breaks nothing else, and nothing of them is left."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import TimeoutError as OutOfTime
from dataclasses import replace
from pathlib import Path

import pytest
from pebble import ProcessExpired

from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask
from refseq_bench.scenarios.campaign.run.workers import LocalWorkers, Processes, broken
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, Store
from tests.scenarios.campaign.chores import Chore
from tests.scenarios.campaign.litter import litter, resident
from tests.scenarios.campaign.made import write_logs

LOG = Log("any.log")
CRASHING = "mine:Crashing"


def question(*methods: str) -> AnswerTask:
    return AnswerTask(methods, LOG, LOG, None, None, 1, 60.0)


def kind(error: BaseException) -> str:
    """In place of an answer: what went wrong."""
    return type(error).__name__


def expired(code: int) -> ProcessExpired:
    return ProcessExpired("it ended", code=code, pid=1)


# --- processes ---


def test_nothing_that_counts_threads_is_loaded_before_a_worker_is_initialised() -> None:
    """A spawned process imports the command line first; BLAS with all cores would round otherwise."""
    code = (
        "import sys, refseq_bench.scenarios.cli.app, refseq_bench.scenarios.campaign.run.worker_init; "
        "sys.exit(bool({'numpy', 'scipy', 'cv2'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture
def processes() -> Iterator[Processes]:
    found = Processes(2)
    yield found
    found.close(at_once=True)


def test_what_goes_well_goes_on_whatever_breaks_beside_it(processes: Processes) -> None:
    calls = [
        processes.call(kind, 1.0, time.sleep, 600),
        processes.call(kind, None, signal.raise_signal, signal.SIGSEGV),
        processes.call(kind, None, int, "none"),
        *(processes.call(kind, 60.0, abs, -number) for number in range(4)),
    ]
    told = [call.result(60) for call in calls]
    assert told == ["TimeoutError", "ProcessExpired", "ValueError", 0, 1, 2, 3]


def test_one_that_dies_while_it_is_idle_takes_nothing_with_it(processes: Processes) -> None:
    for _ in range(2):
        pid = processes.call(lambda error: 0, None, os.getpid).result(60)
        assert pid not in (0, os.getpid())
        os.kill(pid, signal.SIGKILL)


def test_what_is_asked_of_processes_that_were_let_go_is_told() -> None:
    processes = Processes(1)
    assert processes.call(kind, None, abs, -1).result(60) == 1
    processes.close(at_once=False)
    assert processes.call(kind, None, abs, -1).result(1) == "RuntimeError"


def test_memory_that_nothing_holds_is_given_back() -> None:
    processes = Processes(1)
    before, _, after = (processes.call(kind, None, each) for each in (resident, litter, resident))
    assert after.result(60) < before.result(60) + 60e6
    processes.close(at_once=True)


def test_they_die_with_their_master(tmp_path: Path) -> None:
    script = (
        "import os, time; from refseq_bench.scenarios.campaign.run.workers import Processes; one = Processes(1); "
        f"one.call(None, None, os.mkdir, {str(tmp_path / 'begun')!r}); one.call(None, None, time.sleep, 600).result()"
    )
    root = Path(__file__).parents[4]
    master = subprocess.Popen([sys.executable, "-c", script], cwd=root, start_new_session=True)
    try:
        wait_for((tmp_path / "begun").exists)
        master.send_signal(signal.SIGKILL)
        master.wait()
        wait_for(lambda: not alive(master.pid), 5)
    finally:
        if alive(master.pid):
            os.killpg(master.pid, signal.SIGKILL)


# --- workers ---


def test_tasks_are_carried_out_in_a_process_that_ends_when_it_is_stopped(tmp_path: Path) -> None:
    others, store, workers = set(multiprocessing.active_children()), Store(tmp_path), LocalWorkers(1, tmp_path)
    tells, raises = (workers.submit(Chore(f"one-{does}", does)) for does in ("tell", "raise"))
    workers.submit(Chore("forever", "hang"))
    assert tells.result(60).good
    pid, told = store.path("one-tell", ANSWERS).read_text().split(maxsplit=2)[1:]
    assert int(pid) != os.getpid()
    assert told == f"['1', '1'] {len(os.sched_getaffinity(0))} PAR1"  # one thread for sums, its share for images

    outcome = raises.result(60)
    assert (outcome.verdict, outcome.reason) == (Verdict.ERROR, "raise one-raise: ValueError: in two lines")
    assert "carry_out" in outcome.details
    assert not store.has("one-raise", ANSWERS)

    wait_for(lambda: bool(list(tmp_path.glob(".refseq-draft-*/*"))))
    begin = time.monotonic()
    workers.close(at_once=True)
    assert time.monotonic() - begin < 5
    assert set(multiprocessing.active_children()) <= others
    store.sweep()
    assert not list(tmp_path.glob(".refseq-draft-*"))


@pytest.mark.parametrize(
    ("task", "error", "verdict", "reason"),
    [
        # Who takes for ever to answer has failed, whoever it is; a drive that does so has not.
        (question("thesis/hmm"), OutOfTime(), "failed", "not done within 60 s (limits.seconds)"),
        (Chore("a", limit=60), OutOfTime(), "error", "not done within 60 s (limits.seconds)"),
        # No user's localiser runs in it: whatever breaks the process is the bench's affair.
        (question(CRASHING), expired(3), "error", "the worker's process ended with exit code 3"),
        (question("vlad"), expired(-11), "error", "the worker's process was killed (SIGSEGV)"),
        (Chore("a"), expired(-11), "error", "the worker's process was killed (SIGSEGV)"),
        (
            Chore("a"),
            expired(-40),
            "error",
            "the worker's process was killed (signal 40)",
        ),  # a real-time one has no name
        (question(CRASHING), RuntimeError("it\nwas closed"), "error", "RuntimeError: it was closed"),
    ],
)
def test_whose_fault_a_broken_process_is(
    task: AnswerTask | Chore, error: BaseException, verdict: str, reason: str
) -> None:
    outcome = broken(task, error)
    assert (outcome.verdict.value, outcome.reason) == (verdict, f"{task.title}: {reason}")


@pytest.mark.slow
def test_a_localiser_that_breaks_its_process_breaks_no_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_logs(tmp_path)
    monkeypatch.chdir(tmp_path)
    crash = "    def __init__(self, views): print('dear me'); __import__('signal').raise_signal(11)\n"
    (tmp_path / "mine.py").write_text(f"class Crashing:\n{crash}")
    monkeypatch.setenv(DATA, str(tmp_path))
    workers = LocalWorkers(1, tmp_path)
    task = AnswerTask((CRASHING,), Log("reference.mcap"), Log("query.mcap"), None, None, 1, 60.0)
    outcome = workers.submit(task).result(120)
    workers.close(at_once=True)
    reason = f"{CRASHING}, learning the reference drive: the localiser was ended by SIGSEGV"
    assert replace(outcome, seconds=0.0) == TaskOutcome(Verdict.ERROR, reason, "dear me\n")


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
