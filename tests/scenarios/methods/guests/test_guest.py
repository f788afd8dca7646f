"""Guests as processes: the same answers as in this process, and confinement that holds."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from refseq.view import View
from refseq_bench.scenarios.methods.guests import confinement, landlock
from refseq_bench.scenarios.methods.guests.confinement import Hold, holds, in_words
from refseq_bench.scenarios.methods.plugins import MisbehavedError, PluginLocaliser
from refseq_bench.scenarios.methods.templates import MY_LOCALISER
from refseq_bench.scenarios.methods.templates.my_localiser import MyLocaliser
from tests.robustness.attacks import guest
from tests.scenarios.methods.folder import written


def test_answers_are_the_same_bits_in_this_process_and_in_a_guest(here: Path, views: list[View]) -> None:
    written(here, MY_LOCALISER[".py"].read_text(), "my_localiser.py")
    inside, outside = MyLocaliser(views), PluginLocaliser("my_localiser:MyLocaliser", views)
    outside.reset()
    for view in (*views, *views[::-1]):
        own, others = inside.update(view), outside.update(view)
        assert own.places.tobytes() == others.places.tobytes()
        assert (own.lost, own.best, own.path, own.entropy) == (others.lost, others.best, others.path, others.entropy)
    outside.close()


METHODS = "    def reset(self): pass\n    def update(self, view): pass\n"


def test_a_package_may_read_its_own_files_and_no_others(here: Path, views: list[View]) -> None:
    init = "    def __init__(self, views): open(os.path.join(os.path.dirname(__file__), {!r}))\n"
    code = f"import os\nclass Mine:\n{init}"
    written(here, "7", "weights.txt")
    written(here, "5", "ours/weights.txt")
    written(here, code.format("weights.txt") + METHODS, "ours/__init__.py")
    PluginLocaliser("ours:Mine", views).close()
    written(here, code.format(str(here / "weights.txt")) + METHODS, "ours/__init__.py")
    with pytest.raises(MisbehavedError, match=r"raised PermissionError: .*weights.txt' \(__init__.py, line 3\)"):
        PluginLocaliser("ours:Mine", views)


def test_modules_within_a_package_and_beside_it_are_found(here: Path, views: list[View]) -> None:
    init = "    def __init__(self, views): 1 / (helper.N + N == 3)\n"
    code = f"from ours.inner.tool import N\nimport helper\nclass Mine:\n{init}"
    written(here, code + METHODS, "ours/mine.py")
    written(here, "N = 1", "ours/inner/tool.py")
    written(here, "N = 2", "helper.py")
    PluginLocaliser("ours.mine:Mine", views).close()


def test_the_spy_finds_what_is_there_where_nothing_keeps_it(tmp_path: Path) -> None:
    """Else that a guest finds nothing would tell nothing."""
    if not sys.platform.startswith("linux"):
        pytest.skip("there is no /proc to spy in")
    (tmp_path / "guest").mkdir()
    (tmp_path / "guest/recording.mcap").write_bytes(b"truth")
    hidden = [byte ^ 255 for byte in np.float64(guest.TRUTH).tobytes()]
    spy = guest.SPY.format(truth=hidden, world=hidden, home=str(Path.home()))
    guest.write_localiser(tmp_path, top=spy)
    program = f"import mine, numpy; x = numpy.full(9, {guest.TRUTH}); mine.spy()"
    said = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    found = {line.removeprefix("FELL ").rpartition(" ")[0] for line in said.splitlines() if line.startswith("FELL")}
    names = " ".join(found)
    for door in ("truth in memory", "/proc/PPID/environ", "/proc/PPID/cmdline", "recording", "list", "/proc/PPID/fd"):
        assert door in names


def test_what_is_missing_is_told() -> None:
    found = (Hold("files", ""), Hold("network", "seccomp"), Hold("other processes", ""))
    assert in_words(found) == "network: seccomp; not kept from files, other processes"
    assert in_words(found[1:2]) == "network: seccomp"


def test_an_old_kernel_keeps_from_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(landlock, "version", lambda: 0)
    monkeypatch.setattr(confinement.seccomp, "available", lambda: False)
    assert [hold.kept_from for hold in holds() if not hold.by] == [
        "files",
        "network",
        "other processes",
        "child processes",
    ]
