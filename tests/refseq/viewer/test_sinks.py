import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager

import numpy as np
import pytest
import rerun as rr

from refseq.access.listener import free_port
from refseq.children import end_tied, start_tied
from refseq.errors import RefseqError
from refseq.viewer import checks, sinks, watched
from refseq.viewer.checks import check_answers, check_free
from refseq.viewer.sinks import connected, served, spawned
from refseq.viewer.watched import gone


@contextmanager
def listener(answer: bytes = b"") -> Iterator[int]:
    """Somebody who listens at a port, and says the same to all."""
    with closing(socket.create_server(("127.0.0.1", 0))) as server:

        def serve() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                connection.sendall(answer)
                connection.close()

        threading.Thread(target=serve, daemon=True).start()
        yield server.getsockname()[1]


@contextmanager
def proxy() -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """Rerun's own server, which takes what a viewer would take and needs no graphics."""
    hidden = sinks.HiddenPort()
    process = start_tied([*sinks.PROGRAM, "--serve-grpc", *hidden.words])
    try:
        sinks._wait(process, hidden)
        yield hidden.address, process
    finally:
        end_tied(process)


@pytest.mark.parametrize(
    "url",
    ["", "localhost:9876", "http://localhost:9876/proxy", "rerun+http://localhost:9876", "rerun+http:///proxy"],
)
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(RefseqError, match="is no viewer's address; valid is rerun"):
        check_answers(url)


@pytest.mark.parametrize("port", ["", ":99999", ":x"])
def test_a_port_is_needed(port: str) -> None:
    with pytest.raises(RefseqError, match="has no port from 1 to 65535"):
        check_answers(f"rerun+http://localhost{port}/proxy")


def test_nobody_there_is_told_before_anything_is_sent() -> None:
    with pytest.raises(RefseqError, match=r"nobody answers .*start one there"):
        check_answers(f"rerun+http://127.0.0.1:{free_port()}/proxy")


def test_what_answers_must_be_a_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    """A web server that is listening at the port; and one that never says a word."""
    with listener(b"HTTP/1.1 400 Bad Request\r\n\r\n") as port, pytest.raises(RefseqError, match="is no Rerun viewer"):
        check_answers(f"rerun+http://127.0.0.1:{port}/proxy")
    monkeypatch.setattr(checks, "ANSWER", 0.2)
    with closing(socket.create_server(("127.0.0.1", 0))) as silent:
        port = silent.getsockname()[1]
        with pytest.raises(RefseqError, match="nobody answers"):
            check_answers(f"rerun+http://127.0.0.1:{port}/proxy")


def test_a_viewer_that_goes_away_neither_stops_nor_blocks_what_is_logged() -> None:
    logged = 0
    with proxy() as (url, process):
        watched = connected(url, "a drive")
        stream = watched.__enter__()
        stream.log("line", rr.Scalars(1.0))
        assert gone(stream, 10.0) is None
        end_tied(process)
        end = time.monotonic() + 30
        while gone(stream) is None:
            assert time.monotonic() < end, "nobody noticed"
        for number in range(500):
            stream.log("line", rr.Scalars(number))
            logged += 1
        with pytest.raises(RefseqError, match="went away before it had all of 'a drive'"):
            watched.__exit__(None, None, None)
    assert logged == 500


def test_a_viewer_that_stalls_is_cut_off_and_what_follows_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rerun would wait for ever, inside a call that nothing interrupts, once 100 MB are under way."""
    monkeypatch.setattr(watched, "STALL", 0.5)
    monkeypatch.setattr(watched, "LOOK", 0.2)
    picture = np.random.default_rng(1).integers(0, 256, (512, 512), dtype=np.uint8)
    with proxy() as (url, process):
        logged = connected(url, "a drive")
        stream = logged.__enter__()
        stream.log("line", rr.Scalars(1.0))
        assert gone(stream, 10.0) is None
        os.killpg(process.pid, signal.SIGSTOP)
        for _ in range(2000):
            stream.log("picture", rr.Image(picture))
        with pytest.raises(RefseqError, match=r"went away before it had all of 'a drive': it has stalled: nothing was"):
            logged.__exit__(None, None, None)


def test_a_viewer_that_stays_gets_all() -> None:
    with proxy() as (url, _), connected(url, "a drive") as stream:
        for number in range(200):
            stream.log("line", rr.Scalars(number))


def test_a_port_that_is_taken_is_told_of() -> None:
    with listener() as port, pytest.raises(RefseqError, match=f"port {port} cannot be served from: Address already"):
        check_free(port)
    check_free(free_port())


def test_a_browser_is_served_on_loopback_alone() -> None:
    port = free_port()
    with served(port, "a drive") as (stream, page):
        stream.log("line", rr.Scalars(1.0))
        assert gone(stream, 10.0) is None
        keeping = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with keeping.open(page, timeout=20) as answer:
            assert b"<html" in answer.read().lower()
            assert answer.url == f"http://127.0.0.1:{port}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{port}%2Fproxy"
        assert not answers(own_address(), port)
        assert answers("127.0.0.1", port)
    assert not answers("127.0.0.1", port)


def own_address() -> str:
    """An address of this machine that is not loopback; without a network there is none, and nothing to be reached."""
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent
        except OSError:
            pytest.skip("this machine has no address but loopback's")
        return str(probe.getsockname()[0])


def answers(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), timeout=2.0):
            return True
    except OSError:
        return False


def test_without_a_display_nothing_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sinks, "start_apart", lambda *_: pytest.fail("a viewer was started"))
    with pytest.raises(RefseqError, match="no display"), spawned("a drive"):
        pass


def test_a_viewer_that_cannot_start_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(RefseqError, match="the viewer could not start, or was closed"), spawned("a drive"):
        pass
