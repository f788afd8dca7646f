"""The watch looks at processes of this machine: at this one, and at one that it ends."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from refseq_bench.scenarios.methods.guests import watch
from refseq_bench.scenarios.methods.guests.limits import GuestLimits
from refseq_bench.scenarios.methods.guests.watch import MOST_FILES, Watch

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="processes are not in /proc")
LITTLE = 1e-5
"""Some 10 kB, in GiB."""


def excess(folder: Path, **limits: float) -> str:
    return Watch(os.getpid(), GuestLimits(**limits), folder)._excess()


def test_nothing_is_said_of_a_guest_within_its_limits(tmp_path: Path) -> None:
    (tmp_path / "own").write_bytes(bytes(1000))
    found = Watch(os.getpid(), GuestLimits(memory=64, threads=4096), tmp_path)
    assert found._excess() == ""
    resident = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    assert found.peak_bytes == pytest.approx(resident, rel=0.2)


def test_each_excess_is_told_with_its_limit(tmp_path: Path) -> None:
    assert excess(tmp_path, memory=LITTLE) == "took more than 1e-05 GiB of memory"
    assert excess(tmp_path, memory=64, threads=0.5) == "began more than 0.5 threads"
    deep = tmp_path / "a" / "b"
    deep.mkdir(parents=True)
    (deep / "hole").touch()
    os.truncate(deep / "hole", 1 << 30)  # takes no room
    assert excess(tmp_path, memory=64, threads=4096, scratch=0.01) == ""
    (deep / "full").write_bytes(os.urandom(1 << 16))
    told = f"wrote more than 1e-05 GiB or {MOST_FILES} files"
    assert excess(tmp_path, memory=64, threads=4096, scratch=LITTLE) == told


def test_many_empty_files_are_too_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "MOST_FILES", 10)
    for number in range(11):
        (tmp_path / str(number)).touch()
    assert excess(tmp_path, memory=64, threads=4096) == ""
    (tmp_path / "one more").touch()
    assert excess(tmp_path, memory=64, threads=4096).endswith(" or 10 files")


def test_what_cannot_be_looked_into_counts_as_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(path: str) -> None:
        raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG), path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "scandir", refused)
        assert excess(tmp_path, memory=64, threads=4096) == "hid what it wrote: File name too long"
    assert excess(tmp_path / "gone meanwhile", memory=64, threads=4096) == ""


def test_it_ends_a_guest_that_takes_too_much(tmp_path: Path) -> None:
    guest = subprocess.Popen([sys.executable, "-I", "-S", "-c", "import time; time.sleep(60)"])
    over = Watch(guest.pid, GuestLimits(memory=LITTLE), tmp_path)
    over.start()
    assert guest.wait() == -signal.SIGKILL
    over.stop()
    assert over.reason == "took more than 1e-05 GiB of memory"


def test_it_is_stopped_and_spares_the_guest(tmp_path: Path) -> None:
    guest = subprocess.Popen([sys.executable, "-I", "-S", "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE)
    over = Watch(guest.pid, GuestLimits(memory=64), tmp_path)
    over.start()
    over.stop()
    assert not over.is_alive()
    guest.communicate()
    assert (guest.returncode, over.reason) == (0, "")
