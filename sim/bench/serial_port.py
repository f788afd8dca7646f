"""The Robuter's spare serial line for a program outside, while a bench runs: over TCP on this machine, or a terminal.

The simulation never waits for the client. What the client does not fetch is lost, as on a line without handshake. One
that goes away leaves a line that is silent: the robot's watchdog stops it, and another may come. No web page comes in,
though a browser lets it send to any port.
"""

import os
import re
import socket
from contextlib import suppress
from typing import Protocol

from refseq.access.policy import LOOPBACK
from refseq_bench.robots.robuter.control import RobuterControl
from refseq_bench.robots.robuter.line import CAPACITY, SerialLine
from refseq_bench.robots.robuter.protocol import END, MAX_LINE, Refusal, format_line
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.realtime import RealTimePacer

REQUEST = re.compile(rb"[A-Za-z]+ .*HTTP/[0-9.]+")
"""First line that a browser sends to any port."""
TLS = b"\x16"
"""First byte of a browser that encrypts."""
TERMINAL = "pty"
"""The address of a pseudo-terminal."""


class Outlet(Protocol):
    """The end of the line that a client is plugged into; nothing here waits or raises because of a client."""

    address: str
    """Where a client finds it."""

    def read(self) -> bytes:
        """Bytes that the client has written since."""

    def write(self, data: bytes) -> None:
        """Give the client as much as it takes at once."""

    def close(self) -> None:
        """Unplug."""


class TcpOutlet:
    """A TCP server on this machine for one client at a time; port 0 is any that is free.

    Raises ``SimError`` for any other host, and where the port cannot be had.
    """

    def __init__(self, host: str = LOOPBACK, port: int = 0) -> None:
        if host != LOOPBACK:
            raise SimError(f"serial port: host '{host}' is not served: valid is {LOOPBACK}, this machine only")
        if not 0 <= port <= 65535:
            raise SimError(f"serial port: TCP port {port} does not exist: valid is 0 to 65535, 0 for any that is free")
        try:
            self._server = socket.create_server((host, port))
        except OSError as error:
            raise SimError(f"serial port: {host}:{port} cannot be opened: {error.strerror}") from None
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self._greeting: bytes | None = b""
        self.address = f"{host}:{self._server.getsockname()[1]}"

    def read(self) -> bytes:
        """Bytes that the client has written since; a new one is let in if there is none."""
        data = self._received()
        self._let_in()
        return data or self._received()

    def write(self, data: bytes) -> None:
        """Give the client as much as it takes at once."""
        if self._client is None or not data:
            return
        try:
            self._client.send(data)
        except BlockingIOError:
            pass
        except OSError:
            self._hang_up()

    def close(self) -> None:
        """Hang up and free the port."""
        self._hang_up()
        self._server.close()

    def _received(self) -> bytes:
        if self._client is None:
            return b""
        try:
            data = self._client.recv(CAPACITY)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data if self._greeting is None else self._first_line(data)

    def _first_line(self, data: bytes) -> bytes:
        """Hold back what a new client sends until its first line is whole; hang up where that may be a browser's.

        A web page may send what it likes to any port of this machine, but not before the line of a request. ``None``
        as greeting: the client has said it.
        """
        self._greeting = (self._greeting or b"") + data
        line, end, _ = self._greeting.partition(END)
        if not end and len(line) <= MAX_LINE:
            return b""
        held, self._greeting = self._greeting, None
        if len(line) > MAX_LINE or line[:1] == TLS or REQUEST.fullmatch(line.rstrip(b"\r")):
            self._hang_up()
            return b""
        return held

    def _let_in(self) -> None:
        try:
            caller, _ = self._server.accept()
        except OSError:
            return
        caller.setblocking(False)
        if self._client is None:
            self._client, self._greeting = caller, b""
        else:
            with caller, suppress(OSError):  # it may be gone again
                caller.send(format_line(Refusal("the line is taken by another client")))

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


class TerminalOutlet:
    """A pseudo-terminal without echo or line editing; ``address`` is the device that a client opens.

    Raises ``SimError`` where the system has none: a bare root without ``/dev/pts``.
    """

    def __init__(self) -> None:
        import tty  # not on every system

        try:
            # The robot's side keeps the client's side open too: else its raw mode would end with the first client.
            self._own, self._theirs, self.address = _named_terminal()
        except OSError as error:
            why = f"{error.strerror}: is /dev/pts mounted?"
            raise SimError(f"serial port: no pseudo-terminal ({why}): valid is {LOOPBACK}:PORT") from None
        tty.setraw(self._theirs)
        os.set_blocking(self._own, False)

    def read(self) -> bytes:
        """Bytes that the client has written since."""
        try:
            return os.read(self._own, CAPACITY)
        except OSError:
            return b""

    def write(self, data: bytes) -> None:
        """Give the client as much as it takes at once."""
        try:
            os.write(self._own, data)
        except OSError:
            return

    def close(self) -> None:
        """Remove the device."""
        os.close(self._own)
        os.close(self._theirs)


def _named_terminal() -> tuple[int, int, str]:
    """Both ends of a new pseudo-terminal and the name of the second; raises ``OSError`` where there is none."""
    own, theirs = os.openpty()
    try:
        return own, theirs, os.ttyname(theirs)
    except OSError:
        os.close(own)
        os.close(theirs)
        raise


class SerialPort:
    """Joins a robot's ``line`` to a client; use it in a ``with`` block."""

    def __init__(self, line: SerialLine, client: Outlet) -> None:
        self._line, self._client = line, client

    @property
    def address(self) -> str:
        """Where a client finds it."""
        return self._client.address

    def __enter__(self) -> "SerialPort":
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def carry(self) -> None:
        """Carry over what waits on either side."""
        self._line.to_robot.put(self._client.read())
        self._client.write(self._line.to_host.take())


def open_port(bench: Bench, address: str) -> SerialPort:
    """Open the robot's spare line at ``127.0.0.1:PORT`` or ``pty``; raises ``SimError`` for anything else."""
    if not isinstance(bench.control, RobuterControl):
        raise SimError(f"serial port: robot '{bench.robot.name}' has no serial line: valid is robuter")
    return SerialPort(bench.control.spare, TerminalOutlet() if address == TERMINAL else _tcp(address))


def serve(bench: Bench, port: SerialPort, duration: float, pace: RealTimePacer | None = None) -> None:
    """Let the bench run for ``duration`` [s] of simulated time while whoever is at the port drives the robot."""
    pace, began = pace or RealTimePacer(), bench.time
    pace.keep(began)
    while bench.time - began < duration - 1e-9:
        port.carry()
        bench.wait()
        port.carry()
        pace.keep(bench.time)


def _tcp(address: str) -> TcpOutlet:
    host, _, port = address.rpartition(":")
    if not (host and port.isascii() and port.isdigit() and len(port) <= 5):
        raise SimError(f"serial port: address '{address}' is not known: valid are {TERMINAL} and {LOOPBACK}:PORT")
    return TcpOutlet(host, int(port))
