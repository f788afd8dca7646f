"""Modules on two hosts, played by two network namespaces: a mission, the key, and a cable that is cut."""

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
REFSEQ = Path(sys.executable).with_name("refseq")
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

    def python(self, *words: str | Path) -> "Talker":
        command = ["nsenter", "-t", str(self.pid), "-n", sys.executable, "-u", *words]
        process = subprocess.Popen(
            command,
            env={**os.environ, "PYTHONPATH": str(ROOT), "REFSEQ_TOKEN": KEY},
            stdout=subprocess.PIPE,
            text=True,
        )
        self.stack.callback(lambda: (process.kill(), process.wait(), process.stdout.close()))
        return Talker(process)

    def refseq(self, *words: str | Path) -> "Talker":
        return self.python(REFSEQ, *words)


class Talker:
    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process

    def until(self, begin: str) -> str:
        """The next line that begins so."""
        return next(line for line in self.process.stdout if line.startswith(begin))


def refseq(folder: Path, *words: str) -> str:
    """Output of a command that runs here, in one process."""
    return subprocess.run([REFSEQ, *words], cwd=folder, check=True, capture_output=True, text=True).stdout


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
            host.ip("link set lo up")  # who talks to the own address
            host.ip("link set cable up")
        yield robot, desk


def test_the_key_lets_in_and_a_cut_cable_is_noticed_on_both_sides(hosts: tuple[Host, Host]) -> None:
    robot, desk = hosts
    speaks, hears = robot.python("-c", SPEAKS), desk.python("-c", HEARS, KEY)
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
    robot.python("-c", SPEAKS)
    stranger = desk.python("-c", HEARS, OTHER)
    assert "or another token" in stranger.until("waits")
    friend = desk.python("-c", HEARS, KEY)
    friend.until("step 0")
    assert stranger.process.poll() is None
    stranger.process.kill()
    assert stranger.process.stdout.read() == ""


def test_a_mission_over_two_hosts_is_that_of_one_process(hosts: tuple[Host, Host], tmp_path: Path) -> None:
    """As the page on modules has it: robot and Control layer on the one, localiser and executor on the other."""
    robot, desk = hosts
    map_file, mission = tmp_path / "offices.refseq", "[LD_LDMC]"
    refseq(tmp_path, "record", "offices", "--behaviours", "MN:26", "--renderer", "none", "-o", "offices.mcap")
    refseq(tmp_path, "learn", "offices.mcap", "--profile", "best", "-o", map_file.name)
    alone = refseq(tmp_path, "mission", "run", map_file.name, mission, "--renderer", "none")
    robot.refseq("module", "robot", map_file, "--renderer", "none", "--host", ROBOT)
    robot.refseq("module", "control", "--address", ROBOT)
    desk.refseq("module", "localiser", map_file, "--address", ROBOT)
    executor = desk.refseq("module", "mission", map_file, mission, "--address", ROBOT)
    told, _ = executor.process.communicate(timeout=300)  # a part that does not come is waited for without end
    log = [line for line in told.splitlines(keepends=True) if line in alone.splitlines(keepends=True)]
    assert executor.process.returncode == 0
    assert "".join(log) == alone
    assert log[-1].endswith("the mission is completed\n")
