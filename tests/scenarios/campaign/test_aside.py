"""Leaving the program beside a case that is still judged."""

import subprocess
import sys

import pytest

JUDGING = """
import sys, time, mujoco
from refseq_bench.scenarios.campaign.aside import aside, leave
body = "<body><freejoint/><geom size='1'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
data = mujoco.MjData(model)
def work():
    while True:
        mujoco.mj_step(model, data, nstep=1000)
aside(work)
time.sleep(0.2)
print("told")
leave(130)
sys.exit(130)
"""


def test_the_code_is_that_of_the_command_and_not_of_a_crash() -> None:
    """A library in which the thread is while Python takes itself down ends the program by a signal."""
    answer = subprocess.run([sys.executable, "-c", JUDGING], capture_output=True, text=True, timeout=60, check=False)
    assert (answer.returncode, answer.stdout, answer.stderr) == (130, "told\n", "")


@pytest.mark.parametrize("work", ["pass", "aside(lambda: 1).result()"])
def test_without_one_nothing_is_done(work: str) -> None:
    words = f"from refseq_bench.scenarios.campaign.aside import aside, leave; {work}; leave(3); print('goes on')"
    answer = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=60, check=False)
    assert (answer.returncode, answer.stdout) == (0, "goes on\n")
