"""Modules on two hosts, played by two network namespaces: the key is asked for, and a cable that is cut is noticed."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from refseq.modules.link import LEASE

pytest.importorskip("zenoh")
pytestmark = pytest.mark.slow
ROBOT, DESK = "10.77.0.1", "10.77.0.2"
STEPS = 90
"""Steps of 0.05 s, more than go by until the cable is there again."""
KEY, OTHER = "3f9ab27c0d1e4856", "ffffffffffffffff"
ROOT = Path(__file__).resolve().parents[3]
SPEAKS = f"""
import sys, time
from refseq.modules.link import opened, policy_for
with opened(policy_for("{ROBOT}", 7447, "{KEY}"), serves=True, waits=print) as link:
    link.join("robot")
    publish = link.publisher("robot/steps", keep=100)
    link.watch(lambda role, there: print(role, there, time.monotonic(), flush=True))
    for number in range(100000):
        publish([("head", str(number).encode())])
        time.sleep(0.05)
"""
HEARS = f"""
import sys, time
from refseq.modules.link import opened, policy_for
with opened(policy_for("{ROBOT}", 7447, sys.argv[1]), serves=False, waits=lambda line: print(line, flush=True)) as link:
    link.join("control")
    link.watch(lambda role, there: print(role, there, time.monotonic(), flush=True))
    heard = []
    link.subscribe("robot/steps", lambda parts: heard.append(parts) or print("step", int(parts[0][1]), flush=True))
    time.sleep(600)
"""


class Host:
    """A network namespace, which ends with the process that holds it."""

    def __init__(self, stack: ExitStack) -> None:
        holder = subprocess.Popen(["unshare", "-n", "sleep", "600"])
        stack.callback(lambda: (holder.kill(), holder.wait()))
        self.pid, self.stack = holder.pid, stack

    def ip(self, words: str) -> None:
        subprocess.run(["nsenter", "-t", str(self.pid), "-n", "ip", *words.split()], check=True, capture_output=True)

    def python(self, program: str, *words: str) -> "Talker":
        command = ["nsenter", "-t", str(self.pid), "-n", sys.executable, "-u", "-c", program, *words]
        process = subprocess.Popen(
            command, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, text=True
        )
        self.stack.callback(lambda: (process.kill(), process.wait(), process.stdout.close()))
        return Talker(process)


class Talker:
    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process

    def until(self, begin: str) -> str:
        """The next line that begins so."""
        return next(line for line in self.process.stdout if line.startswith(begin))


@pytest.fixture
def hosts() -> Iterator[tuple[Host, Host]]:
    """The robot and the desk, with a cable between them."""
    if os.geteuid() or not all(map(shutil.which, ("unshare", "nsenter", "ip"))):
        pytest.skip("network namespaces need root, unshare, nsenter and ip")
    with ExitStack() as stack:
        robot, desk = Host(stack), Host(stack)
        own = Path("/proc/self/ns/net").readlink()
        end = time.monotonic() + 10
        while any(Path(f"/proc/{host.pid}/ns/net").readlink() == own for host in (robot, desk)):
            if time.monotonic() > end:
                pytest.skip("this kernel gives no network namespaces")
            time.sleep(0.05)
        try:
            robot.ip(f"link add cable type veth peer name cable netns {desk.pid}")
        except subprocess.CalledProcessError as error:
            pytest.skip(f"no virtual cable here: {error.stderr!r}")
        for host, address in ((robot, ROBOT), (desk, DESK)):
            host.ip(f"address add {address}/24 dev cable")
            host.ip("link set cable up")
        yield robot, desk


def test_the_key_lets_in_and_a_cut_cable_is_noticed_on_both_sides(hosts: tuple[Host, Host]) -> None:
    robot, desk = hosts
    speaks, hears = robot.python(SPEAKS), desk.python(HEARS, KEY)
    speaks.until("control True")
    hears.until("step 0")  # from before it came
    robot.ip("link set cable down")
    cut = time.monotonic()
    for talker, role in ((speaks, "control"), (hears, "robot")):
        seconds = float(talker.until(f"{role} False").split()[2]) - cut
        assert LEASE / 4 < seconds < 10, "a busy machine is late"
    robot.ip("link set cable up")
    speaks.until("control True")
    after = [int(hears.until("step").split()[1]) for _ in range(STEPS)]
    assert after == list(range(after[0], after[0] + STEPS)), "none of those is lost that were sent meanwhile"


def test_another_key_is_not_let_in(hosts: tuple[Host, Host]) -> None:
    robot, desk = hosts
    robot.python(SPEAKS)
    stranger = desk.python(HEARS, OTHER)
    assert "or another token" in stranger.until("waits")
    friend = desk.python(HEARS, KEY)
    friend.until("step 0")
    assert stranger.process.poll() is None
    stranger.process.kill()
    assert stranger.process.stdout.read() == ""
