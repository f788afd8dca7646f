"""The judge of the fuzzers tells each way in which a command may fall, and runs the real command line."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.robustness.fuzzing import Outcome, fell, judged, run

REFUSED = Outcome(code=2, out="", err="error: a.mcap: is empty\n", cpu=0.1, peak=0, left=())
PASSED = replace(REFUSED, code=0, out="a.mcap: 3 views\n", err="")


def test_what_survives() -> None:
    assert judged(REFUSED) is None
    assert judged(PASSED) is None
    assert judged(replace(REFUSED, err=f"note: a.mcap was cut off\n{REFUSED.err}")) is None
    assert judged(replace(PASSED, err="note: a.mcap was cut off\n", left=("b.tum",))) is None
    assert judged(replace(PASSED, code=1), codes=(0, 1, 2)) is None


@pytest.mark.parametrize(
    ("found", "told"),
    [
        (replace(REFUSED, code=3, err="Traceback …\nKeyError: 7\n"), "exit code 3: KeyError: 7"),
        (replace(PASSED, code=1), "exit code 1: nothing on stderr"),
        (replace(REFUSED, err="RuntimeWarning: overflow\nerror: is empty\n"), "refused in 2 lines"),
        (replace(REFUSED, err="is empty\n"), "refused in 1 lines"),
        (replace(REFUSED, err=f"error: {2000 * 'a'}\n"), "refused in a line of 2007 characters"),
        (replace(REFUSED, err="error: topic \x1b[2J\n"), "printed the control character '\\x1b'"),
        (replace(REFUSED, left=("b.tum",)), "left b.tum"),
        (replace(PASSED, err="RuntimeWarning: overflow\n"), "exit code 0, and on stderr: RuntimeWarning"),
        (replace(PASSED, out=""), "exit code 0 without any output"),
        (replace(PASSED, cpu=5.1), "took 5.1 s of CPU"),
        (replace(PASSED, peak=2 << 30), "took 0.1 s of CPU and 2048 MiB"),
        (replace(PASSED, code=-24), "took 5 s of CPU"),
        (replace(PASSED, code=-14), "waited for 120 s"),
        (replace(PASSED, code=-11), "ended by signal 11"),
    ],
)
def test_what_falls(found: Outcome, told: str) -> None:
    assert (judged(found) or "").startswith(told)


@pytest.mark.slow
def test_the_real_command_line(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text("no log at all\n")
    found = run(["log", "convert", "a.log", "-o", "b.tum"], tmp_path)
    assert found.code == 2
    assert found.err.startswith("error: a.log: is text, so a CARMEN log, and holds no scan")
    assert fell(["log", "info", "missing.mcap"], tmp_path) is None
