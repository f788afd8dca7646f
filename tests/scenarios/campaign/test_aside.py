"""Leaving the program beside a case that is still judged."""

import subprocess
import sys

import pytest

JUDGING = """
import sys, time, mujoco
from refseq_bench.scenarios.campaign.aside import aside, leave
from refseq_bench.scenarios.cli.app import main
body = "<body><freejoint/><geom size='1'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
data = mujoco.MjData(model)
def work():
    while True:
        mujoco.mj_step(model, data, nstep=1000)
aside(work)
time.sleep(0.2)
print("told")
"""


@pytest.mark.parametrize(
    ("last", "code", "told"),
    [("leave(130); sys.exit(130)", 130, ""), ("sys.argv[1:] = ['nonsense']; main()", 2, "error: command 'nonsense'")],
    ids=["alone", "the command line"],
)
def test_the_code_is_that_of_the_command_and_not_of_a_crash(last: str, code: int, told: str) -> None:
    """A library in which the thread is while Python takes itself down ends the program by a signal."""
    words = [sys.executable, "-c", JUDGING + last]
    answer = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (answer.returncode, answer.stdout) == (code, "told\n")
    assert answer.stderr.startswith(told)
    assert len(answer.stderr.splitlines()) == bool(told)


@pytest.mark.parametrize("work", ["pass", "aside(lambda: 1).result()"])
def test_without_one_nothing_is_done(work: str) -> None:
    words = f"from refseq_bench.scenarios.campaign.aside import aside, leave; {work}; leave(3); print('goes on')"
    answer = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=60, check=False)
    assert (answer.returncode, answer.stdout) == (0, "goes on\n")
