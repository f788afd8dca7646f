"""Strangers at the doors: pages, programs and nonsense, at every server that a command of ours opens."""

import random
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from tests.robustness.attack import Attempt, attack
from tests.robustness.commands import Command, running, until

KEPT = 60.0
"""Memory that a server may keep of an attack [MB]: allocators do not give back all."""
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "BREW", "get")
PATHS = (
    *("/", "/model", "/state", "/ui", "/drop", "/web_client.js", "/re_viewer.js", "/assets/../../../../etc/passwd"),
    *("/rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages", "/%2e%2e/%2e%2e/etc/passwd", "//", "/?token=", "*"),
    *("http://169.254.169.254/", "/\\..\\", "/model?crc32=" + "9" * 99, "/" + "a" * 4000, "/;/", "/%00", "/\xff"),
)
HOSTS = (
    *("evil.example", "evil.example:{port}", "127.0.0.1.evil.example", "192.168.0.1:{port}", "[::ffff:1.2.3.4]"),
    *("", "@", "evil.example@127.0.0.1"),
)
ORIGINS = (
    *("http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1", "http://evil.example:{port}"),
)
POST = b"POST /model HTTP/1.1\r\nHost: 127.0.0.1\r\n"
UPGRADE = (
    "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
)  # fmt: skip


def door(seed: int) -> Command:
    """The server that a seed attacks: most often the quickest to start."""
    return running(("serve", "view", "drive")[seed % 3])


@contextmanager
def line_to(command: Command, seconds: float = 30.0) -> Iterator[socket.socket]:
    """A connection to a command's port."""
    with socket.create_connection(("127.0.0.1", command.port), timeout=seconds) as line:
        yield line


def asked(command: Command, data: bytes) -> bytes:
    """The answer to some bytes, up to the first megabyte."""
    got = b""
    with line_to(command) as line, suppress(ConnectionError):
        line.sendall(data)
        while len(got) < 1 << 20 and (more := line.recv(1 << 16)):
            got += more
    return got


def request(command: Command, method: str, path: str, headers: list[str], host: str = "127.0.0.1:{port}") -> bytes:
    """Bytes of a request that ends its connection."""
    words = [f"{method} {path} HTTP/1.1", f"Host: {host}", *headers]
    return ("\r\n".join(words).replace("{port}", str(command.port)) + "\r\n\r\n").encode("latin-1")


def token_words(command: Command) -> tuple[str, list[str]]:
    """The path and the headers with which a door opens."""
    if command.address.startswith("ws"):
        return f"/{command.token}", [*UPGRADE]
    return f"/?token={command.token}", ["Connection: close"]


def opens(command: Command) -> bool:
    """Tell whether somebody who has the address comes in."""
    path, headers = token_words(command)
    with line_to(command) as line, suppress(ConnectionError, TimeoutError):
        line.sendall(request(command, "GET", path, headers))
        return line.recv(1 << 10).split()[1:2] in ([b"101"], [b"303"])
    return False


def after(command: Command, before: float) -> Attempt:
    """State of a server after an attack: it opens, says nothing, and has not grown."""
    back = until(lambda: opens(command), 60.0)
    # What is still on its way through, or waits to be collected, is not kept.
    until(lambda: command.memory() - before <= KEPT, 10.0)
    grown = command.memory() - before
    figures = {"MB kept": max(grown, 0.0)}
    if not back:
        return Attempt("nobody comes in any more", figures)
    if said := command.said():
        return Attempt(f"it complained: {said[:200]}", figures)
    return Attempt(f"{grown:.0f} MB are kept" if grown > KEPT else None, figures)


@attack(
    family="doors", promise="No page, name or program without the token gets more than a refusal", tries=900, short=1
)
def strangers(seed: int, folder: Path) -> Attempt | str | None:
    command, rng = door(seed), random.Random(seed)
    for _ in range(10):
        right, headers = token_words(command)
        fault = rng.choice(("host", "origin", "token"))
        host = rng.choice(HOSTS) if fault == "host" else "127.0.0.1:{port}"
        headers = rng.choice((headers, [*UPGRADE], ["Connection: close"], []))
        headers = [*headers, f"Origin: {rng.choice(ORIGINS)}"] if fault == "origin" else headers
        path = rng.choice(PATHS) if fault == "token" or rng.random() < 0.5 else right
        if rng.random() < 0.3:
            headers = [*headers, f"Cookie: refseq-{command.port}={'0' * 32}", f"Authorization: Bearer {'0' * 32}"]
        sent = request(command, rng.choice(METHODS), path, [*headers, "Connection: close"], host)
        (folder / "request").write_bytes(sent)
        answer = asked(command, sent)
        head, _, body = answer.partition(b"\r\n\r\n")
        if head and head.split()[1:2] and head.split()[1][:1] not in (b"4", b"5"):
            return f"{head.splitlines()[0]!r} to {sent[:80]!r}"
        if b"access-control-allow" in head.lower() or len(body) > 300 or command.token.encode() in answer:
            return f"told too much: {answer[:100]!r}"
    return after(command, command.memory())


@attack(family="doors", promise="Bytes that are no request end their connection alone", tries=300, short=1)
def nonsense(seed: int, folder: Path) -> Attempt:
    command, rng = door(seed), random.Random(seed)
    before = command.memory()
    path, headers = token_words(command)
    for _ in range(5):
        kind = rng.randrange(6)
        if kind == 0:
            data = rng.randbytes(rng.randrange(1, 5000)) + b"\r\n\r\n"
        elif kind == 1:
            data = request(command, "GET", path, [f"X-{n}: {'a' * 3000}" for n in range(rng.randrange(1, 200))])
        elif kind == 2:
            data = b"GET /" + b"a" * (1 << 20)
        elif kind == 3:
            data = POST + b"Content-Length: 99999999999999\r\n\r\n" + bytes(1 << 20)
        elif kind == 4:
            data = POST + b"Transfer-Encoding: chunked\r\n\r\nFFFFFFFFFF\r\n" + bytes(99)
        else:
            data = request(command, "GET", path, headers) + rng.randbytes(3000)
        (folder / "data").write_bytes(data)
        with line_to(command, 2.0) as line, suppress(OSError):
            line.sendall(data)
            line.shutdown(socket.SHUT_WR)
            while line.recv(1 << 16):
                pass
    return after(command, before)


@attack(
    family="doors", promise="Of 1000 connections that say nothing or little, the next with the token comes in",
    tries=6, short=1,
)  # fmt: skip
def crowd(seed: int, folder: Path) -> Attempt:
    command, rng = door(seed), random.Random(seed)
    before, began = command.memory(), time.monotonic()
    with ExitStack() as lines:
        for number in range(1000):
            line = lines.enter_context(socket.socket())
            line.settimeout(5.0)
            with suppress(OSError):
                line.connect(("127.0.0.1", command.port))
                if number % 2:
                    line.send(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "[: rng.randrange(1, 45)])
            if number % 250 == 0 and number:
                time.sleep(0.1)
        came = until(lambda: opens(command), 60.0)
        grown = command.memory() - before
    figures = {"s until one came in": time.monotonic() - began, "MB grown": max(grown, 0.0)}
    if not came:
        return Attempt("nobody came in within 60 s", figures)
    if said := command.said():
        return Attempt(f"it complained: {said[:200]}", figures)
    return Attempt(f"it grew by {grown:.0f} MB" if grown > KEPT else None, figures)


def masked(opcode: int, payload: bytes, final: bool = True) -> bytes:
    """A WebSocket frame as a client sends it, masked by zeros."""
    size = len(payload)
    length = bytes([0x80 | size]) if size < 126 else b"\xff" + struct.pack(">Q", size)
    return bytes([opcode | 0x80 * final]) + length + bytes(4) + payload


@attack(
    family="doors", promise="What somebody with the token floods a socket with is not kept", tries=12, short=1,
)  # fmt: skip
def flood(seed: int, folder: Path) -> Attempt:
    command, rng = door(seed), random.Random(seed)
    sockets = ("/state?sid=a", "/ui?sid=a", "/drop?sid=a")
    before = command.memory()
    path, headers = token_words(command)
    if command.address.startswith("http"):
        answer = asked(command, request(command, "GET", path, headers)).decode("latin-1")
        cookie = next(one for one in answer.splitlines() if one.startswith("Set-Cookie: "))[12:].partition(";")[0]
        path, headers = rng.choice(sockets), [*UPGRADE, f"Cookie: {cookie}"]
    megabytes, most, sent = {0: 20, 2: 700}.get(seed, 100), 0.0, 0
    for _ in range(20):
        with line_to(command, 2.0) as line, suppress(OSError):
            line.sendall(request(command, "GET", path, headers))
            line.recv(1 << 12)
            opcode = rng.choice((1, 2, 2, 2, 9))
            piece = masked(opcode, bytes(100 if opcode == 9 else rng.choice((1 << 10, 1 << 16, 1 << 20, 1 << 23))))
            while sent < megabytes * 1_000_000:
                line.sendall(piece)
                sent += len(piece)
                if sent // 10_000_000 > (sent - len(piece)) // 10_000_000:
                    most = max(most, command.memory() - before)
        most = max(most, command.memory() - before)
    attempt = after(command, before)
    if attempt.fell is None and most > 200.0:
        return Attempt(f"it grew by {most:.0f} MB", attempt.figures)
    return Attempt(attempt.fell, {**attempt.figures, "MB sent": sent / 1e6, "MB grown": most})


@attack(family="doors", promise="A web page moves no robot over its serial port", tries=60, short=1)
def page_at_a_serial_port(seed: int, folder: Path) -> str | None:
    command, rng = running("robot"), random.Random(seed)
    path = "/" + "a" * rng.choice((0, 3, 480, 600, 5000))
    orders = b"AM 300 300\n" * 50
    sent = request(command, rng.choice(("POST", "GET", "OPTIONS", "PUT")), path, ["Content-Length: 550"]) + orders
    with line_to(command) as line, suppress(OSError):
        for at in range(0, len(sent), cut := rng.choice((1 << 20, 400, 100))):
            line.sendall(sent[at : at + cut])
            time.sleep(0.02)
        while told := line.recv(1 << 12):
            if b"ack" in told:
                return f"it obeyed {sent[:60]!r}"
    with line_to(command) as line:
        line.sendall(b"ST\n")
        state = line.makefile("rb").readline()
        return None if state.startswith((b"st", b"em")) else f"it answers {state!r} afterwards"
