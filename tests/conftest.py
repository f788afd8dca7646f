"""What holds for all tests."""

import gc
import importlib
import os
import signal
import uuid
from collections.abc import Generator, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings

from refseq.features.memory import DescriptionMemory, described_once
from refseq.features.neural.network import FILE
from refseq.freed_memory import keep_freed_memory
from tests.key_network import write_key_network
from tests.slowest import slowest

# An example may take long for the first time, or on a busy machine: no test asserts a time on the wall clock.
# Each run draws other examples: many runs of a few find what one of many does. The nightly one draws many.
settings.register_profile("quick", deadline=None, max_examples=25)
settings.register_profile("thorough", deadline=None, max_examples=400)
settings.load_profile("quick")

# As the commands do it, and campaigns' workers.
keep_freed_memory()

# A shell without job control lets what it starts in the background ignore Ctrl-C, and children inherit that: those that
# tests start and interrupt would go on.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Look for no garbage while tests are collected, nor later among what they are: millions of objects, which stay.

    That is a seventh of the time of collecting, and most of what each measurement of memory takes.
    """
    gc.disable()
    import_share(session.config)
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def import_share(config: pytest.Config) -> None:
    """Import a stretch of the test modules before the others, each worker another one.

    All workers import all modules. In a fresh checkout, where none is compiled yet, each would compile each of them,
    and rewrite its assertions, at the same time as the others. So it finds most of them done.
    """
    worker = getattr(config, "workerinput", None)
    if worker is None or config.args != config.getini("testpaths"):
        return
    number, count = int(worker["workerid"].removeprefix("gw")), worker["workercount"]
    modules = [
        ".".join(path.relative_to(TESTS.parent).with_suffix("").parts) for path in sorted(TESTS.rglob("test_*.py"))
    ]
    begin, end = len(modules) * number // count, len(modules) * (number + 1) // count
    for name in modules[begin:end]:
        # Who is not fit to be imported is told when it is collected.
        with suppress(Exception, pytest.skip.Exception):
            importlib.import_module(name)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark cases as slow by the ids of their parameters, before pytest leaves out what is slow."""
    known: dict[str, set[str]] = {}
    for item in items:
        case = getattr(item, "callspec", None)
        named = item.get_closest_marker("slow_cases") or item.get_closest_marker("quick_cases")
        if case is None or named is None:
            continue
        known.setdefault(item.nodeid.partition("[")[0], set(named.args)).discard(case.id)
        if (case.id in named.args) == (named.name == "slow_cases"):
            item.add_marker(pytest.mark.slow)
    whole = not any("::" in word for word in config.args)
    if whole and (missing := {test: ids for test, ids in known.items() if ids}):
        raise pytest.UsageError(f"cases that are named in a mark are not there: {missing}")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell the slowest tests in the summary of a run on GitHub; `./run` prints them in any case."""
    if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
        reports = [one for some in terminalreporter.stats.values() for one in some if hasattr(one, "duration")]
        with Path(summary).open("a", encoding="utf-8") as file:
            file.write(slowest(reports))


TESTS = Path(__file__).parent
DESCRIBED_ANEW = ("benchmarks", "contract", "refseq/features", "robustness", "scenarios/methods/test_by_name.py")
"""Tests of what a picture is described as: its repeatability, its time, and whether it is the same without a memory."""
MEMORY = DescriptionMemory()
"""Of this process: most tests drive through the same corridor, whose pictures take longer than all that follows."""


@pytest.fixture(scope="module", autouse=True)
def pictures_are_described_once(request: pytest.FixtureRequest) -> Iterator[None]:
    """Remember what a picture was described as, from test to test, as a campaign does from method to method."""
    if request.path.relative_to(TESTS).as_posix().startswith(DESCRIBED_ANEW):
        yield
    else:
        with described_once(MEMORY):
            yield


@pytest.fixture(scope="session", autouse=True)
def a_network_finds_keys(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Name a small network for all that ask one, whatever the user has."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FILE, str(write_key_network(tmp_path_factory.mktemp("network") / "keys.onnx")))
        yield


@pytest.fixture(scope="session", autouse=True)
def no_server_is_left(worker_mark: str) -> Iterator[None]:
    """End what tests have left listening, and tell of it: the next run would find its ports taken."""
    yield
    left = listening_children(worker_mark)
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    assert not left, f"servers are left by tests: {list(left.values())}"


@pytest.fixture(scope="session")
def worker_mark() -> Iterator[str]:
    """A variable that all processes have which tests of this process start, also those that lost their parents."""
    mark = os.environ["REFSEQ_TESTED"] = uuid.uuid4().hex
    yield mark
    del os.environ["REFSEQ_TESTED"]


def listening_children(mark: str) -> dict[int, str]:
    """Processes with a mark that listen at a port, and their commands; those of attacks end with this process."""
    tables = [path.read_text() for path in map(Path, ("/proc/net/tcp", "/proc/net/tcp6")) if path.exists()]
    rows = [line.split() for table in tables for line in table.splitlines()[1:]]
    inodes = {row[9] for row in rows if row[3] == "0A"}
    found = {}
    for entry in Path("/proc").iterdir() if inodes else ():
        with suppress(OSError):
            known = (entry / "environ").read_bytes() if entry.name.isdigit() else b""
            if f"REFSEQ_TESTED={mark}".encode() not in known or b"REFSEQ_ATTACKED=" in known:
                continue
            links = [str(one.readlink()) for one in (entry / "fd").iterdir()]
            if any(link.startswith("socket:") and link[8:-1] in inodes for link in links):
                found[int(entry.name)] = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    return found
