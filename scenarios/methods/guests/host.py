"""Host of a localiser written in Python: the guest's side of the protocol, around the user's class."""

import os
import random
import sys
import sysconfig
import time
import traceback
from collections.abc import Callable, Sequence
from importlib import import_module
from io import TextIOWrapper
from operator import attrgetter
from pathlib import Path

import numpy as np

from refseq.belief import LocaliserProtocol
from refseq.view import View
from refseq_bench.scenarios.methods.guests.wire import (
    LENGTHS,
    PROTOCOL,
    GuestMessage,
    Kind,
    belief_message,
    packed,
    parsed,
    view_of,
)
from refseq_bench.scenarios.methods.plugin_answers import NoAnswerError, checked
from refseq_bench.scenarios.scoring.cost import bytes_kept

PARTS = ("reset", "update")
LONGEST_REASON = 1000
"""Characters of an exception's message that are told."""


def serve(localiser: str, threads: int) -> None:
    """Serve the localiser ``package.module:Class`` over the standard streams until these are closed.

    What it prints goes to standard error, for standard output belongs to the protocol.
    """
    source, sink = os.dup(0), os.dup(1)
    os.dup2(2, 1)
    with Path(os.devnull).open("rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    host = _Host(localiser, threads)
    with os.fdopen(source, "rb") as requests:
        while prefix := requests.read(LENGTHS.size):
            header, payload = (requests.read(length) for length in LENGTHS.unpack(prefix))
            for piece in host.reply(parsed(header, payload)):
                while piece:
                    piece = piece[os.write(sink, piece) :]


class _Host:
    """The user's localiser, and what the bench has sent for it to learn."""

    def __init__(self, localiser: str, threads: int) -> None:
        self._name, self._threads = localiser, threads
        self._views: list[View] = []
        self._places = 0
        self._mishap: list[memoryview] = []
        self._maker: Callable[[Sequence[View]], LocaliserProtocol] | None = None
        self._inner: LocaliserProtocol | None = None

    def reply(self, message: GuestMessage) -> list[memoryview]:
        """The answer to a message, no piece where none is due; whatever the user's code raises is an answer too."""
        try:
            return self._mishap or self._reply(message)
        except NoAnswerError as mistake:
            reason = str(mistake)
        except BaseException as error:
            traceback.print_exc()
            reason = f"raised {type(error).__name__}: {_line(error)}{_place(error)}"
        self._mishap = packed(Kind.ERROR, {"reason": reason})
        return [] if message.kind == Kind.LEARN else self._mishap  # the bench reads nothing while it sends views

    def _reply(self, message: GuestMessage) -> list[memoryview]:
        match message.kind:
            case Kind.HELLO:
                self._load(message.header["seed"])
                return packed(Kind.HELLO, {"protocol": PROTOCOL, "cost": True})
            case Kind.LEARN:
                self._views.append(view_of(message))
                return []
            case Kind.LEARNT:
                self._learn()
            case Kind.RESET:
                self._localiser.reset()
            case Kind.LOCALISE:
                return self._localise(view_of(message))
            case Kind.COST:
                return packed(Kind.COST, {"bytes_kept": bytes_kept(self._inner)})
        return packed(Kind.OK, {})

    def _load(self, seed: int) -> None:
        """Import the class. Global generators are seeded: who draws from them answers the same each time."""
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002 - it is the user's code that may use it
        module, _, attribute = self._name.partition(":")
        made = attrgetter(attribute)(import_module(module))
        if not callable(made):
            raise TypeError(f"{self._name} is no class but {type(made).__name__}")
        self._maker = made
        if opencv := sys.modules.get("cv2"):
            opencv.setNumThreads(self._threads)

    def _learn(self) -> None:
        assert self._maker is not None
        self._places = len(self._views)
        self._inner = self._maker(self._views)
        for part in PARTS:
            if not callable(getattr(self._inner, part, None)):
                raise NoAnswerError(f"has no {part}(); valid is what fits refseq.belief.LocaliserProtocol")
        self._views = []

    @property
    def _localiser(self) -> LocaliserProtocol:
        assert self._inner is not None
        return self._inner

    def _localise(self, view: View) -> list[memoryview]:
        begin = time.perf_counter()
        belief = self._localiser.update(view)
        seconds = time.perf_counter() - begin
        return belief_message(checked(belief, self._places, seconds))


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:LONGEST_REASON] or "no message"


def _place(error: BaseException) -> str:
    """Where the user's code was when it raised: the innermost line that is not the bench's, Python's or a package's."""
    frames = reversed(traceback.extract_tb(error.__traceback__))
    lines = (f" ({Path(one.filename).name}, line {one.lineno})" for one in frames if _written_by_user(one.filename))
    return next(lines, "")


def _written_by_user(file: str) -> bool:
    bench = Path(__file__).parents[4]
    others = (sysconfig.get_path("stdlib"), sysconfig.get_path("purelib"), str(bench))
    return not file.startswith(("<", *others))
