"""Sinks of a recording beside files: a viewer of its own, one that runs elsewhere, or a browser.

Rerun itself connects without saying whether anybody is there, listens on every network, and drops what it could not
send: all that is looked at here, and told in one line as a ``RefseqError``.
"""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http import HTTPMethod
from typing import TYPE_CHECKING
from urllib.parse import quote, urlsplit

import rerun as rr

from refseq.access.listener import free_port, hidden_host
from refseq.access.policy import AccessPolicy
from refseq.children import end_tied, start_apart, start_tied
from refseq.errors import RefseqError
from refseq.viewer.checks import check_answers, check_display
from refseq.viewer.recording import BATCH, new_stream_of
from refseq.viewer.watched import WatchedStream

if TYPE_CHECKING:
    from refseq.access.proxy import ProxiedPage

MEMORY = "50%"
"""Share of the machine's memory at which a viewer or server drops the oldest data."""
START = 30.0
"""Seconds that a viewer may take to start."""
PROGRAM = (sys.executable, "-c", "import sys; from rerun_cli.__main__ import main; sys.exit(main())")
"""Rerun's program. ``python -m rerun`` imports the library first, which takes seconds; ``-m rerun_cli`` exits with 0
whatever happens."""
READ = "/rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages"
"""The call by which Rerun's page asks its server; it never writes."""


@contextmanager
def connected(url: str, recording: str, batches: rr.ChunkBatcherConfig = BATCH) -> Iterator[rr.RecordingStream]:
    """A stream to a viewer that runs already, as ``rerun+http://host:port/proxy``.

    Raises ``RefseqError`` for an address that is none, when nobody answers there, and at the end when the viewer went
    away, or stalled, before it had all. Such a viewer never stops the block itself: what it logs is dropped.
    """
    check_answers(url)
    stream = new_stream_of(WatchedStream, recording, batches)
    parts = urlsplit(url)
    try:
        _connect(stream, url)
        stream.watch(parts.hostname or "", parts.port or 0)
        yield stream
        stream.check()
        if stream.lost:
            raise RefseqError(f"viewer {url}: went away before it had all of {recording!r}: {stream.lost}")
    finally:
        stream.end_watch()
        with suppress(RuntimeError):  # what could not be sent was told of above
            stream.disconnect()


def _connect(stream: rr.RecordingStream, url: str) -> None:
    try:
        stream.connect_grpc(url)
    except RuntimeError as error:
        raise RefseqError(f"viewer {url}: {error}") from error


@contextmanager
def spawned(
    recording: str, memory: str = MEMORY, batches: rr.ChunkBatcherConfig = BATCH
) -> Iterator[rr.RecordingStream]:
    """A stream to a viewer that is started for it and stays open. Raises ``RefseqError`` without a display."""
    check_display()
    hidden = HiddenPort()
    process = start_apart([*PROGRAM, *hidden.words, "--memory-limit", memory, "--expect-data-soon"])
    try:
        _wait(process, hidden)
        with connected(hidden.address, recording, batches) as stream:
            yield stream
    except RefseqError as error:
        raise (_ended(process, recording) or error) from error
    if ended := _ended(process, recording):  # it listens before it opens its window, and may fail to
        raise ended


@contextmanager
def served(
    port: int, recording: str, memory: str = MEMORY, batches: rr.ChunkBatcherConfig = BATCH
) -> Iterator[tuple[rr.RecordingStream, str]]:
    """A stream to a server for browsers on this machine alone, and the page to open; it ends with the block.

    Rerun's own servers ask nobody who they are: they are at an address that nobody guesses, behind a proxy that asks.
    Raises ``RefseqError`` for a port that is taken.
    """
    from refseq.access.proxy import proxied

    messages = HiddenPort()
    page = HiddenPort(messages.host)
    told = ("--serve-web", *messages.words, "--web-viewer-port", str(page.port), "--server-memory-limit", memory)
    with proxied(_page(messages, page), AccessPolicy(port=port)) as proxy:
        process = start_tied([*PROGRAM, *told])
        try:
            _wait(process, messages)
            _wait(process, page)
            with connected(messages.address, recording, batches) as stream:
                yield stream, proxy.address
        except RefseqError as error:
            raise (_ended(process, recording) or error) from error
        finally:
            end_tied(process)


def _page(messages: "HiddenPort", page: "HiddenPort") -> "ProxiedPage":
    from refseq.access.proxy import ProxiedPage, ProxyRoute

    files = ("/", "/favicon.ico", "/favicon.svg", "/apple-touch-icon.png", "/re_viewer.js", "/re_viewer_bg.wasm")
    routes = [ProxyRoute(path, page.origin) for path in files]
    return ProxiedPage(
        (*routes, ProxyRoute(READ, messages.origin, HTTPMethod.POST)),
        lambda host: f"/?url={quote(f'rerun+http://{host}/proxy', safe='')}",
    )


# --- ports ---


@dataclass(frozen=True, slots=True)
class HiddenPort:
    """An address of this machine that nobody guesses, for a server of Rerun's."""

    host: str = field(default_factory=hidden_host)
    port: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "port", free_port(self.host))

    @property
    def origin(self) -> str:
        """Address for HTTP."""
        return f"http://{self.host}:{self.port}"

    @property
    def address(self) -> str:
        """Address for streams."""
        return f"rerun+{self.origin}/proxy"

    @property
    def words(self) -> tuple[str, ...]:
        """Options of Rerun to listen there."""
        return "--bind", self.host, "--port", str(self.port)


# --- processes ---


def _wait(process: "subprocess.Popen[bytes]", at: HiddenPort) -> None:
    """Wait until Rerun listens. Raises ``RefseqError`` when it ends, or takes too long."""
    end = time.monotonic() + START
    while time.monotonic() < end and process.poll() is None:
        with suppress(OSError), socket.create_connection((at.host, at.port), timeout=1.0):
            return
        time.sleep(0.05)
    end_tied(process)
    raise RefseqError(f"the viewer did not listen within {START:g} s")


def _ended(process: "subprocess.Popen[bytes]", recording: str) -> RefseqError | None:
    """The error of a viewer that has ended; ``None`` if it runs."""
    with suppress(subprocess.TimeoutExpired):
        code = process.wait(1.0)
        return RefseqError(
            f"the viewer could not start, or was closed before it had all of {recording!r} (exit code {code}); "
            "'rerun' alone tells more, and 'refseq doctor' what is missing"
        )
    return None
