"""The viewer in the browser: it is served on this machine alone, and what keeps it from starting is one line."""

import gc
import socket
import urllib.request
import warnings
from collections.abc import Iterator
from dataclasses import replace

import pytest

from refseq.access.listener import free_port
from refseq.access.policy import LOOPBACK, AccessPolicy
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.teleop.commands import Button, Commands, SessionStatus
from refseq_bench.sim.teleop.session import run_session
from refseq_bench.sim.teleop.viewer import ViewerSettings, capture_page
from tests.sim.drives.behaving_in import corridor


@pytest.fixture
def bench() -> Iterator[Bench]:
    settings = BenchSettings(RendererKind.NONE, cameras=())
    with Bench(corridor(), robots.load("robuter"), seed=3, settings=settings) as bench:
        yield bench


@pytest.fixture(autouse=True)
def collected() -> Iterator[None]:
    """Collect what MuJoCo's page left open here: its sockets' warnings would fall on whichever test comes next."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


def look(port: int) -> ViewerSettings:
    return ViewerSettings("x", AccessPolicy(port=port), rate=100.0)


def test_a_page_is_served_on_this_machine_alone_and_a_drive_does_not_need_it(bench: Bench) -> None:
    """One viewer for both: of a second one in a process, MuJoCo 4.0's thread may not end."""
    port = free_port()
    told: list[str] = []
    with capture_page(replace(look(port), told=told.append)) as page, page.leading(bench) as source:
        asked = [source.commands(SessionStatus(time=0.04 * n)) for n in range(5)]
        assert asked == [Commands(None)] * 5, "no browser, nobody at the controls"

        class Person:
            def commands(self, status: SessionStatus) -> Commands:
                source.commands(status)
                buttons = {0: (Button.START,), 25: (Button.STOP,)}
                return Commands(robots.Twist(0.3, 0.0), buttons.get(round(status.time / 0.04), ()))

        assert len(list(run_session(bench, Person(), None))) == 1, "the drive ends as ever"
        (address,) = told
        assert address.startswith(f"http://{LOOPBACK}:{port}/?token=")
        assert b"<title>Capture</title>" in by_address(address)
        other = socket.gethostbyname(socket.gethostname())
        if not other.startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((other, port), timeout=5)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((LOOPBACK, port), timeout=5)


def by_address(address: str) -> bytes:
    """The page, as a browser gets it that keeps cookies."""
    keeping = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    return bytes(keeping.open(address, timeout=60).read())


def test_a_port_that_is_taken_is_told_in_a_line() -> None:
    with socket.socket() as taken:
        taken.bind((LOOPBACK, 0))
        taken.listen()
        port = taken.getsockname()[1]
        told = rf"^the page {LOOPBACK} port {port}: cannot be served from: .*; valid is a free port, or 0$"
        with pytest.raises(SimError, match=told), capture_page(look(port)):
            pass
