"""A stream to a viewer that may stall: it is given a few seconds, then it is cut off, and the run goes on.

Rerun itself keeps 100 MB for a viewer that takes nothing, then waits for it inside a call that nothing interrupts.
"""

import socket
import sys
import time
from contextlib import suppress
from threading import Event, Lock, Thread
from typing import Any

import rerun as rr

from refseq.access.listener import own_sockets

STALL = 5.0
"""Seconds in which a viewer has to take something of what waits; a shorter time would cut off a busy machine's."""
LOOK = 1.0
"""Period in which is looked whether the viewer takes what it is sent [s]."""
MOST_BEHIND = 64
"""Calls after which the viewer is waited for: what waits then is some ten megabytes."""
ACKED, INFO = 120, 136
"""Where Linux' ``tcp_info`` has the bytes that the other end has taken and those that it has sent, and their end."""


class WatchedStream(rr.RecordingStream):
    """A stream that drops all that is logged once its viewer has gone away or stalled; ``lost`` then tells why."""

    lost = ""

    def watch(self, host: str, port: int) -> None:
        """Begin to watch the connection to a viewer's address. Raises ``OSError`` for a name that nobody has."""
        self._peers, self._behind = {found[4][:2] for found in socket.getaddrinfo(host, port)}, 0
        self._checking, self._over = Lock(), Event()
        Thread(target=self._follow, daemon=True, name="viewer's watch").start()

    def log(self, *given: Any, **more: Any) -> None:
        """As ``rerun.RecordingStream.log``."""
        if self.lost:
            return
        self._behind += 1
        if self._behind >= MOST_BEHIND:
            self.check()
        super().log(*given, **more)

    def _follow(self) -> None:
        while not self.lost and not self._over.wait(LOOK):
            if self._behind:
                self.check()

    def check(self) -> None:
        """Wait until the viewer has all that was logged; one that takes nothing meanwhile is cut off."""
        with self._checking:
            taken, since = self._taken(), time.monotonic()
            while not self.lost:
                behind, self._behind = self._behind, 0
                reason = gone(self)
                if reason is None:
                    return
                self._behind += behind
                if "timed out" not in reason:
                    self.lost = reason
                elif (now := self._taken()) != taken:
                    taken, since = now, time.monotonic()
                elif time.monotonic() - since > STALL:
                    self.lost = f"it has stalled: nothing was taken for {STALL:g} s"
                    self._cut()

    def end_watch(self) -> None:
        """Watch no more."""
        self._over.set()

    def _taken(self) -> bytes:
        """Counters of what the viewer took and sent, where the system has them."""
        with suppress(OSError):
            for one in own_sockets(self._peers):
                with one:
                    if sys.platform == "linux":
                        return one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, INFO)[ACKED:]
        return b""

    def _cut(self) -> None:
        for one in own_sockets(self._peers):
            with one, suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)


def gone(stream: rr.RecordingStream, patience: float = LOOK) -> str | None:
    """Why the viewer does not take what is sent, within so many seconds; ``None`` while it does."""
    try:
        stream.flush(timeout_sec=patience)
    except (RuntimeError, ValueError) as error:
        return str(error).partition(", uri")[0]
    return None
