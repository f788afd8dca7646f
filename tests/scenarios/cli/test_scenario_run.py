"""``refseq scenario run`` as a user meets it; drives are short and have a laser only."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer

from refseq_bench.scenarios.campaign import results
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.progress import ProgressLines
from refseq_bench.scenarios.campaign.run import workers
from refseq_bench.scenarios.campaign.store.cache import RECORDING, Store
from refseq_bench.scenarios.cli.scenario import _leave
from tests.scenarios.campaign.chores import AtOnce, scenario_in
from tests.scenarios.campaign.run.test_workers import alive, wait_for
from tests.scenarios.campaign.store.test_cache import needs_root
from tests.scenarios.cli.test_app import environment
from tests.scenarios.conftest import Refseq

MISSED = "failures >= 999"


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache that fills as the tests go on: equal drives are recorded once."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario; the pages, which have tests of their own, are not written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(results.Results, "add", lambda *given: None)
    return scenario_in(tmp_path)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "LocalWorkers", lambda _count, folder: AtOnce(Store(folder)))


def kept(said: str) -> tuple[int, ...]:
    """Tasks done, of how many, and those that were kept from before, of the last line that tells."""
    found = re.findall(r"(\d+) of (\d+) tasks done, (\d+) of them kept", said)
    return tuple(map(int, found[-1]))


@pytest.mark.quick_cases("at once")
@pytest.mark.parametrize("how", ["at once", "by two workers"])
def test_a_second_run_does_nothing_again_and_says_the_same(
    refseq: Refseq, file: Path, tmp_path: Path, request: pytest.FixtureRequest, how: str
) -> None:
    if how == "at once":
        request.getfixturevalue("quick")
    cache = tmp_path / "cache"
    first = refseq("scenario", "run", file, "--cache", cache, "-j", 2)
    assert first.code == 0
    assert "passed: tiny" in first.out
    assert "1 case: 1 passed" in first.out.splitlines()
    assert kept(first.err)[:2] == (3, 3)
    files = {path: path.stat().st_mtime_ns for path in cache.iterdir() if path.name != ".lock"}
    second = refseq("scenario", "run", file, "--cache", cache)
    assert kept(second.err) == (3, 3, 3)
    assert second.out == first.out
    assert {path: path.stat().st_mtime_ns for path in cache.iterdir() if path.name != ".lock"} == files
    size = sum(path.stat().st_size for path in files)
    assert f"{size / 1000:.3g} kB kept in {cache}" in second.err


def test_what_another_campaign_left_in_the_folder_is_told(refseq: Refseq, file: Path, cache: Path, quick: None) -> None:
    other = file.with_name("other.toml")
    other.write_text(file.read_text())
    notes = [refseq("scenario", "run", *given, "--cache", cache).err for given in ([file], [file, other], [other])]
    assert ["note: out/campaign held the result of tiny, begun " in told for told in notes] == [False, False, True]


@pytest.mark.parametrize("home", [None, "empty"])
def test_a_real_set_that_is_absent_is_one_line_and_the_rest_runs(
    refseq: Refseq, file: Path, cache: Path, quick: None, monkeypatch: pytest.MonkeyPatch, home: str | None
) -> None:
    monkeypatch.delenv(DATA, raising=False)
    if home:
        (file.parent / home).mkdir()
        monkeypatch.setenv(DATA, str(file.parent / home))
    real = 'title = "Real"\nseeds = [1, 2]\n[reference]\nlog = "far/away.clf"\nodometry_noise = true\n[query]\n'
    (file.parent / "real.toml").write_text(real)
    answer = refseq("scenario", "run", file.parent / "real.toml", file, "--cache", cache)
    assert answer.code == 0
    assert answer.out.splitlines()[:3] == ["skipped: real", "passed: tiny", "2 cases: 1 skipped, 1 passed"]
    assert answer.err.count("far/away.clf") == 1
    assert "Traceback" not in answer.err


def test_fresh_asks_anew_and_meets_a_damaged_recording(refseq: Refseq, file: Path, cache: Path, quick: None) -> None:
    refseq("scenario", "run", file, "--cache", cache)
    recording = next(iter(cache.glob(f"*{RECORDING}")))
    content = recording.read_bytes()
    middle = len(content) // 2
    recording.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    answer = refseq("scenario", "run", file, "--cache", cache, "--fresh")
    assert answer.code == 0
    assert f"{recording}: is damaged" in answer.err
    assert "it is made anew" in answer.err
    assert recording.read_bytes() == content  # equal drives give equal recordings, bit for bit


@pytest.mark.parametrize(
    ("verdicts", "code"),
    [
        ([], 0),
        ([Verdict.PASSED], 0),
        ([Verdict.SKIPPED, Verdict.PASSED], 0),
        ([Verdict.SKIPPED], 1),
        ([Verdict.SKIPPED, Verdict.SKIPPED], 1),
        ([Verdict.SKIPPED, Verdict.FAILED, Verdict.PASSED], 1),
        ([Verdict.FAILED, Verdict.ERROR, Verdict.SKIPPED], 2),
    ],
)
def test_exit_code_is_no_success_where_nothing_was_judged(verdicts: list[Verdict], code: int) -> None:
    apart = SimpleNamespace(verdict=Verdict.ERROR, case=case_of(blocking=False))
    results: Any = [SimpleNamespace(verdict=one, case=case_of(blocking=True)) for one in verdicts]
    with pytest.raises(typer.Exit) if code else nullcontext() as left:
        _leave([*results, apart])
    assert code == (left.value.exit_code if left else 0)


def case_of(*, blocking: bool) -> SimpleNamespace:
    return SimpleNamespace(scenario=SimpleNamespace(blocking=blocking))


@pytest.mark.parametrize(("more", "code"), [("blocking = true", 1), ("blocking = false", 0)])
def test_only_what_is_blocking_changes_the_exit_code(
    refseq: Refseq, file: Path, cache: Path, quick: None, more: str, code: int
) -> None:
    text = file.read_text().replace('expect = ["success >= 0 %"]', f'expect = ["{MISSED}"]\n{more}')
    (file.parent / "other.toml").write_text(text)
    answer = refseq("scenario", "run", "other.toml", file, "--cache", cache)
    assert answer.code == code
    assert "passed: tiny" in answer.out
    apart = "" if code else " (not blocking)"
    assert f"failed: other{apart}\n" in answer.out
    assert f"missed: {MISSED} (it is " in answer.err


def test_a_robot_that_takes_too_long_has_failed(refseq: Refseq, file: Path, cache: Path, quick: None) -> None:
    file.write_text(file.read_text() + "[limits]\nsteps = 20\n")
    answer = refseq("scenario", "run", file, "--cache", cache, "--seeds", 7)
    assert answer.code == 1
    assert "failed: tiny" in answer.out
    reasons = [line for line in answer.err.splitlines() if line.startswith("  ")]
    assert len(reasons) == 2
    assert re.fullmatch(
        r"  drive small 16:00 by robuter, seed 7: the robot came 0\.\d m of .* it is stuck at x .*", reasons[0]
    )
    assert reasons[1] == "  not judged: success >= 0 % (no seed was run to its end)"


@needs_root
def test_a_full_disk_is_one_line_and_an_error(refseq: Refseq, file: Path, tmp_path: Path, quick: None) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", disk], check=True)
    try:
        answer = refseq("scenario", "run", file, "--cache", disk)
        assert answer.code == 2
        assert "error: tiny" in answer.out
        assert re.search(r"^  drive .*\.mcap: cannot be kept: No space left on device$", answer.err, re.MULTILINE)
        assert "Traceback" not in answer.err
        assert list(disk.iterdir()) == []
    finally:
        subprocess.run(["umount", disk], check=True)


def test_a_cache_that_cannot_be_written_to_is_told_before_the_run(refseq: Refseq, file: Path) -> None:
    answer = refseq("scenario", "run", file, "-o", "out", "--cache", file / "cache")
    assert (answer.code, answer.err.count("\n")) == (2, 1)
    assert "cache: cannot hold what is kept: Not a directory; valid is" in answer.err
    assert answer.err.endswith("by --cache or REFSEQ_CACHE\n")
    assert not Path("out").exists()


@pytest.mark.parametrize("seeds", ["", "1,1", "1;2", "-1", "one", "1,"])
def test_seeds_that_are_none_are_told(refseq: Refseq, file: Path, cache: Path, seeds: str) -> None:
    answer = refseq("scenario", "run", file, "--cache", cache, "--seeds", seeds)
    assert answer.code == 2
    assert answer.err.startswith(f"error: --seeds {seeds!r} is not valid")


# --- a cluster that cannot be used ---


@pytest.fixture
def stranger() -> Iterator[int]:
    """A port at which something answers that is no Ray."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            line, _ = server.accept()
            with line:
                line.recv(100)
                line.sendall(b"HTTP/1.0 400 Bad request\r\n\r\n")

        threading.Thread(target=answer, daemon=True).start()
        yield server.getsockname()[1]


def refused(refseq: Refseq, file: Path, *words: str | Path) -> str:
    """The one line in which a cluster is refused, within seconds."""
    begin = time.monotonic()
    answer = refseq("scenario", "run", file, *words)
    assert time.monotonic() - begin < 15
    assert answer.code == 2
    assert not answer.out
    assert len(answer.err.splitlines()) == 1
    return answer.err


def test_an_address_where_nothing_answers_is_told(refseq: Refseq, file: Path, cache: Path) -> None:
    pytest.importorskip("ray")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    said = refused(refseq, file, "--cache", cache, "--ray", f"127.0.0.1:{port}")
    assert f"--ray '127.0.0.1:{port}': no cluster answers there: Connection refused" in said


def test_an_address_where_another_answers_is_told(refseq: Refseq, file: Path, cache: Path, stranger: int) -> None:
    pytest.importorskip("ray")
    assert "what answers there is no Ray" in refused(refseq, file, "--cache", cache, "--ray", f"127.0.0.1:{stranger}")


@pytest.mark.parametrize("address", ["here", "10.0.0.1", ":6379", "host:port", "ray://host:10001", "host:0"])
def test_what_is_no_address_is_told(refseq: Refseq, file: Path, cache: Path, address: str) -> None:
    pytest.importorskip("ray")
    said = refused(refseq, file, "--cache", cache, "--ray", address)
    assert f"--ray {address!r} is not valid; it should be HOST:PORT, or auto" in said


def test_without_ray_the_extra_is_named(
    refseq: Refseq, file: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    assert "pip install '.[ray]' in a clone" in refused(refseq, file, "--cache", cache, "--ray", "10.0.0.1:6379")


def test_a_cluster_has_its_own_workers(refseq: Refseq, file: Path, cache: Path) -> None:
    said = refused(refseq, file, "--cache", cache, "--ray", "10.0.0.1:6379", "-j", "2")
    assert "--workers and --ray exclude each other" in said


def test_a_cluster_that_is_refused_leaves_the_results_of_the_folder(
    refseq: Refseq, file: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    (file.parent / "out").mkdir()
    earlier = file.parent / "out" / "result.json"
    earlier.write_text("of an earlier run")
    refused(refseq, file, "--cache", cache, "--ray", "10.0.0.1:6379", "-o", "out")
    assert earlier.read_text() == "of an earlier run"


def test_a_folder_that_is_refused_lets_the_workers_go(
    refseq: Refseq, file: Path, cache: Path, quick: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = list[bool]()
    monkeypatch.setattr(AtOnce, "close", lambda _workers, *, at_once: closed.append(at_once))
    (file.parent / "out").mkdir()
    (file.parent / "out" / "index.html").touch()
    assert "that no run has made" in refused(refseq, file, "--cache", cache, "-o", "out")
    assert closed == [True]


# --- Ctrl-C ---


def test_who_interrupts_is_told_what_is_kept_and_how_to_go_on(
    refseq: Refseq, file: Path, tmp_path: Path, quick: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(watcher: ProgressLines) -> None:
        if watcher.done == 2:
            raise KeyboardInterrupt

    cache = tmp_path / "cache"
    with monkeypatch.context() as patched:
        patched.setattr(ProgressLines, "tick", interrupted)
        first = refseq("scenario", "run", file, "--cache", cache)
    assert first.code == 130
    assert not first.out
    assert first.err.splitlines()[-1] == (
        f"interrupted: 2 done, 0 kept from before: all is kept in {cache}, and the same command goes on from there"
    )
    second = refseq("scenario", "run", file, "--cache", cache)
    assert (second.code, kept(second.err)) == (0, (3, 3, 2))


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_or_a_cancelled_job_ends_all_and_the_same_command_goes_on(
    how: signal.Signals, refseq: Refseq, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, cache = scenario_in(tmp_path, seeds=range(1, 9)), tmp_path / "cache"
    words = ["scenario", "run", str(file), "--cache", str(cache), "-o", str(tmp_path / "out")]
    first = subprocess.Popen(
        [sys.executable, "-c", "from refseq_bench.scenarios.cli.app import main; main()", *words, "-j", "2"],
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert first.stderr
    lines = iter(first.stderr.readline, "")
    assert any(line.startswith("[3/") for line in lines)  # both drives of a seed, at least
    if how is signal.SIGINT:
        os.killpg(first.pid, how)  # as a terminal does, to all processes at once
    else:
        first.send_signal(how)
    begin = time.monotonic()
    said = "".join(lines)
    code = first.wait(30)
    assert time.monotonic() - begin < 10
    assert code == 130
    wait_for(lambda: not alive(first.pid), 5)
    assert not list(cache.glob(".refseq-draft-*"))
    done = int(re.search(r"interrupted: (\d+) done, 0 kept from before", said)[1])  # type: ignore[index]
    assert 1 <= done < 24
    # It goes on, here with one seed of those that were begun: what was done is not done again.
    recordings = set(cache.glob(f"*{RECORDING}"))
    monkeypatch.setattr(results.Results, "add", lambda *given: None)
    second = refseq(*words, "--seeds", "1")
    assert kept(second.err)[2] >= 2
    assert set(cache.glob(f"*{RECORDING}")) == recordings
