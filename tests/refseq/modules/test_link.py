"""The link on loopback: late comers hear what was kept, roles are held by one, and a wrong token never comes in."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from refseq.access.listener import free_port
from refseq.access.policy import LOOPBACK, AccessPolicy, random_token
from refseq.errors import RefseqError
from refseq.modules.heads import Parts
from refseq.modules.link import opened, policy_for
from refseq.modules.process import Role

pytest.importorskip("zenoh")


def until(reached: Callable[[], bool], seconds: float = 30.0) -> bool:
    end = time.monotonic() + seconds
    while not reached() and time.monotonic() < end:
        time.sleep(0.01)
    return reached()


def test_who_comes_late_hears_all_in_order() -> None:
    policy = AccessPolicy(LOOPBACK, free_port(), random_token())
    heard: list[Parts] = []
    roles: dict[str, bool] = {}
    with opened(policy, serves=True, waits=pytest.fail) as robot:
        publish = robot.publisher("robot/steps", keep=100)
        robot.watch(roles.__setitem__)
        for number in range(50):
            publish([("head", str(number).encode()), ("laser", bytes(3000))])
        with opened(policy, serves=False, waits=pytest.fail) as late:
            late.join("mission")
            late.subscribe("robot/steps", heard.append)
            assert until(lambda: len(heard) == 50)
            publish([("head", b"50")])
            assert until(lambda: len(heard) == 51)
            assert until(lambda: roles.get("mission", False))
            with pytest.raises(RefseqError, match="module 'mission': one is there already; valid is one at a time"):
                robot.join(Role.MISSION)
        assert until(lambda: not roles["mission"])
    assert [parts[0] for parts in heard] == [("head", str(number).encode()) for number in range(51)]


def test_of_two_that_come_at_once_one_has_the_role() -> None:
    policy = AccessPolicy(LOOPBACK, free_port(), random_token())
    together, told = threading.Barrier(2), threading.Barrier(2)

    def come(_: int) -> str:
        with opened(policy, serves=False, waits=pytest.fail) as link:
            together.wait()
            try:
                link.join(Role.LOCALISER)
            except RefseqError as error:
                return str(error)
            else:
                return "joined"
            finally:
                told.wait()

    with opened(policy, serves=True, waits=pytest.fail), ThreadPoolExecutor(2) as pool:
        found = sorted(pool.map(come, range(2)))
    assert found == ["joined", "module 'localiser': one is there already; valid is one at a time"]


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "robot.local"])
def test_other_hosts_need_a_token(host: str) -> None:
    with pytest.raises(RefseqError, match="is reached from other machines; valid is --token"):
        policy_for(host, 7447, "")


def test_on_this_machine_a_user_has_one_token(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setenv("HOME", str(tmp_path))
    first, second = (policy_for(LOOPBACK, 7447, "").token for _ in range(2))
    assert first == second
    [kept] = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert kept.stat().st_mode & 0o077 == 0
