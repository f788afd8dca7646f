"""Sockets that listen: no more connections than are served, and where asked for none but this process' own."""

import errno
import os
import socket
from collections.abc import Collection, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from refseq.access.policy import LOOPBACK
from refseq.errors import RefseqError

DESCRIPTORS = Path("/dev/fd")
"""Numbers of the files that this process has open, where the system tells them."""


class BoundedListener(socket.socket):
    """A listening socket that hangs up on further connections while ``most`` are open.

    ``private``: and on all that did not begin in this process, where the system tells (not on Windows).
    """

    def __init__(self, listening: socket.socket, most: int, *, private: bool = False) -> None:
        super().__init__(listening.family, listening.type, listening.proto, listening.detach())
        self.setblocking(False)
        self._most, self._private = most, private
        self._open: list[socket.socket] = []

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection. Raises ``BlockingIOError``, as when there is none, after one that was hung up on."""
        connection, peer = super().accept()
        self._open = [one for one in self._open if one.fileno() >= 0]
        if len(self._open) >= self._most or (self._private and not _is_own(peer)):
            connection.close()
            raise BlockingIOError
        self._open.append(connection)
        return connection, peer


def listening(host: str, port: int, most: int) -> BoundedListener:
    """Listen at an address; port 0 is any that is free. Raises ``RefseqError`` where that cannot be done."""
    try:
        found = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except (OSError, OverflowError) as error:
        code = getattr(error, "errno", None)  # the text of some repeats the address
        reason = os.strerror(code) if code and code > 0 else str(error)
        elsewhere = isinstance(error, socket.gaierror) or code == errno.EADDRNOTAVAIL
        valid = f"valid is {'an address of this machine and ' if elsewhere else ''}a free port"
        raise RefseqError(f"{host} port {port}: cannot be served from: {reason}; {valid}") from error
    return BoundedListener(found, most)


def free_port(host: str = LOOPBACK) -> int:
    """A port of this machine that nobody listens at."""
    with closing(socket.socket()) as found:
        found.bind((host, 0))
        return int(found.getsockname()[1])


def hidden_host() -> str:
    """An address of this machine's own network (127.0.0.0/8) that nobody guesses, for servers that ask no token.

    Where the system has but one such address (macOS), that one.
    """
    host = ".".join(["127", *(str(1 + byte % 254) for byte in os.urandom(3))])
    with socket.socket() as trial:
        try:
            trial.bind((host, 0))
        except OSError:
            return LOOPBACK
    return host


def own_sockets(peers: Collection[Any]) -> Iterator[socket.socket]:
    """Copies, to be closed, of this process' sockets that are connected to an address (host, port) of several.

    None where the system does not tell.
    """
    for one in _sockets():
        with suppress(OSError):
            if one.getpeername()[:2] in peers:
                yield one
                continue
        one.close()


def _is_own(peer: Any) -> bool:
    """Tell whether the other end of a connection is a socket of this process."""
    if not DESCRIPTORS.is_dir():
        return True
    for one in _sockets():
        with one, suppress(OSError):
            if one.getsockname() == peer:
                return True
    return False


def _sockets() -> Iterator[socket.socket]:
    """Copies of this process' open sockets."""
    for name in [entry.name for entry in DESCRIPTORS.iterdir()] if DESCRIPTORS.is_dir() else ():
        with suppress(OSError):
            copy = os.dup(int(name))
            try:
                yield socket.socket(fileno=copy)
            except OSError:  # another kind of file
                with suppress(OSError):
                    os.close(copy)
