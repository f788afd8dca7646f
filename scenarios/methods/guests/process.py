"""Process of a guest as the bench sees it: started confined, told and asked within limits of time, ended as a whole."""

import contextlib
import fcntl
import os
import select
import signal
import subprocess
import sys
import time
import weakref
from collections import deque
from collections.abc import Sequence

from refseq.children import signal_name
from refseq.threads import ONE_THREAD
from refseq_bench.scenarios.methods.guests import launch
from refseq_bench.scenarios.methods.guests.folder import GuestCode, GuestFolder
from refseq_bench.scenarios.methods.guests.limits import GuestLimits
from refseq_bench.scenarios.methods.guests.said import Said, printable
from refseq_bench.scenarios.methods.guests.watch import Watch
from refseq_bench.scenarios.methods.guests.wire import GuestMessage, Incoming, Kind, WireError

PIPE_BYTES = 1 << 20
"""Size of the pipe to a guest, where the system lets us: a view of two cameras fits and is handed over at once."""
CHUNK = 1 << 16
LAST_WORDS = 1.0
"""Time that a guest which has closed its streams is given to end, so that its exit code is known [s]."""
LONGEST_REASON = 1000
"""Characters of what a guest gives as its reason that are told."""
HAS_ENDED = os.WEXITED | os.WNOHANG | os.WNOWAIT
FORWARDED = ("PATH", "LD_LIBRARY_PATH", "CUDA_VISIBLE_DEVICES", "TZ")


class GuestError(Exception):
    """A guest died, was ended or did not answer as it should; the message says how, ``said`` are its last lines."""

    def __init__(self, reason: str, said: str = "") -> None:
        super().__init__(reason)
        self.said = said


class Guest:
    """A process of its own in a session of its own, which is sent messages and answers to them.

    Each call raises ``GuestError`` as soon as the guest has ended, or has not done in time what it should; it is then
    ended. It does not outlive this object, nor this process.
    """

    def __init__(self, code: GuestCode, limits: GuestLimits) -> None:
        self._folder = GuestFolder(code, limits)
        environment = {name: os.environ[name] for name in FORWARDED if name in os.environ}
        scratch = str(self._folder.scratch)
        environment |= {**ONE_THREAD, "HOME": scratch, "TMPDIR": scratch, "LC_ALL": "C.UTF-8", "PYTHONHASHSEED": "0"}
        self._process = subprocess.Popen(
            [sys.executable, "-s", "-P", "-B", launch.__file__, str(self._folder.order)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            cwd=scratch,
            env=environment,
            start_new_session=True,
        )
        streams = (self._process.stdin, self._process.stdout, self._process.stderr)
        self._in, self._out, self._err = (stream.fileno() for stream in streams if stream)
        for descriptor in (self._in, self._out, self._err):
            os.set_blocking(descriptor, False)
        _widen(self._in)
        self.said, self._hearing = Said(), True
        self._watch = Watch(self._process.pid, limits, self._folder.scratch)
        self._watch.start()
        self._end = weakref.finalize(self, _end, self._process, self._watch, self._folder)

    @property
    def peak_bytes(self) -> int:
        """The most memory that it was seen to have resident."""
        return self._watch.peak_bytes

    def tell(self, message: Sequence[memoryview], seconds: float) -> None:
        """Send a message to which there is no answer."""
        self._exchange(message, None, seconds)

    def ask(self, message: Sequence[memoryview], due: Kind, seconds: float, most: int = 0) -> GuestMessage:
        """Send a message and wait for the answer ``due``, whose payload has at most so many bytes."""
        if self._out in self._ready(0, writing=False, reading=True):
            raise self.failed("sent something before it was asked" if os.read(self._out, 1) else "")
        incoming = Incoming(most)
        try:
            self._exchange(message, incoming, seconds)
            answer = incoming.message
        except WireError as mistake:
            raise self.failed(str(mistake)) from None
        if answer.kind == Kind.ERROR:
            raise self.failed(printable(str(answer.header.get("reason", "")))[:LONGEST_REASON] or "told no reason")
        if answer.kind != due:
            raise self.failed(f"answered {answer.kind!r:.40}; valid is {due.value!r} or {Kind.ERROR.value!r}")
        return answer

    def failed(self, reason: str = "") -> GuestError:
        """End it, and give the error that says why: the reason given, or how it ended of itself."""
        code = self._gone(0.0 if reason else LAST_WORDS)
        self._watch.stop()
        self.close()
        return GuestError(self._watch.reason or reason or _end_in_words(code), self.said.last)

    def close(self) -> None:
        """End it, having heard its last words."""
        if self._end.alive:
            self._hear()
            self._end()

    def _exchange(self, message: Sequence[memoryview], incoming: Incoming | None, seconds: float) -> None:
        """Write a message and read another, and meanwhile hear what it says on standard error."""
        deadline = time.monotonic() + seconds
        left = deque(piece for piece in message if piece.nbytes)
        while left or (incoming and incoming.missing):
            rest = deadline - time.monotonic()
            if rest <= 0:
                raise self.failed(f"did not answer within {seconds:g} s")
            for descriptor in self._ready(rest, writing=bool(left), reading=incoming is not None):
                if descriptor == self._err:
                    self._hear()
                elif descriptor == self._in:
                    self._send(left)
                elif incoming:
                    self._receive(incoming)

    def _ready(self, seconds: float, *, writing: bool, reading: bool) -> list[int]:
        poll = select.poll()
        for descriptor, events, wanted in (
            (self._in, select.POLLOUT, writing),
            (self._out, select.POLLIN, reading),
            (self._err, select.POLLIN, self._hearing),
        ):
            if wanted:
                poll.register(descriptor, events)
        return [descriptor for descriptor, _ in poll.poll(1e3 * seconds)]

    def _send(self, left: deque[memoryview]) -> None:
        try:
            left[0] = left[0][os.write(self._in, left[0]) :]
        except BlockingIOError:
            return
        except BrokenPipeError:
            raise self.failed() from None
        if not left[0].nbytes:
            left.popleft()

    def _receive(self, incoming: Incoming) -> None:
        piece = os.read(self._out, min(incoming.missing, CHUNK))
        if not piece:
            raise self.failed()
        incoming.take(piece)

    def _hear(self) -> None:
        """Take what it has said on standard error; a bounded amount, for it may say more than is ever read."""
        try:
            piece = os.read(self._err, CHUNK)
        except BlockingIOError:
            return
        self._hearing = bool(piece)
        self.said.hear(piece)

    def _gone(self, seconds: float) -> int | None:
        """Its exit code, negative for a signal, if it has ended or does so within that time; it is not yet reaped."""
        deadline = time.monotonic() + seconds
        while (found := os.waitid(os.P_PID, self._process.pid, HAS_ENDED)) is None and time.monotonic() < deadline:
            time.sleep(0.01)
        if found is None:
            return None
        return found.si_status if found.si_code == os.CLD_EXITED else -found.si_status


def _end_in_words(code: int | None) -> str:
    if code is None:
        return "the localiser closed its pipe"
    if code >= 0:
        return f"the localiser ended with code {code}"
    return f"the localiser was ended by {signal_name(-code)}"


def _widen(pipe: int) -> None:
    if hasattr(fcntl, "F_SETPIPE_SZ"):
        with contextlib.suppress(OSError):
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)


def _end(process: "subprocess.Popen[bytes]", watch: Watch, folder: GuestFolder) -> None:
    """End a guest with all that is in its process group, and remove its folder."""
    watch.stop()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream:
            stream.close()
    process.wait()
    folder.close()
