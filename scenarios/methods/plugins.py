"""Localisers that users bring: a class by ``package.module:Class``, an entry point by its name, a program by its path.

The class is made with the reference drive's views and fits ``refseq.belief.LocaliserProtocol``: ``reset()`` and
``update(view)``. It is given views without their true poses, whose arrays cannot be written to, and each of its answers
is looked at. None of a user's code is ever run in the bench: it is a guest in a process of its own
(``refseq_bench.scenarios.methods.guests``).
"""

import importlib
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType

from refseq.belief import Belief
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.imports.closure import PACKAGES, closure_of, spec_of
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.guests.folder import GuestCode
from refseq_bench.scenarios.methods.guests.limits import SETTING, limits_here
from refseq_bench.scenarios.methods.guests.process import Guest, GuestError
from refseq_bench.scenarios.methods.guests.wire import (
    PROTOCOL,
    GuestMessage,
    Kind,
    WireError,
    belief_of,
    packed,
    view_message,
)
from refseq_bench.scenarios.methods.plugin_answers import NoAnswerError, checked
from refseq_bench.scenarios.methods.plugin_sources import top_names
from refseq_bench.scenarios.methods.programs import (
    check_program,
    is_program,
    program_digest,
    program_files,
    program_of,
)

GROUP = "refseq.localisers"
"""Group of entry points."""

SEED = 1
"""Seed that a guest is given for its draws; the drives' own tell what is to be seen."""


class MisbehavedError(Exception):
    """A localiser died, raised, or gave an answer that is none: one line says which. ``said`` are its last lines."""

    def __init__(self, reason: str, said: str = "") -> None:
        super().__init__(reason)
        self.said = said


def is_plugin(name: str) -> bool:
    """Tell whether a method's name is that of a user's localiser. A baseline's name always means the baseline."""
    return is_program(name) or ":" in name or (name in installed() and name not in BASELINES)


def installed() -> tuple[str, ...]:
    """Names of the localisers that installed packages bring."""
    return tuple(sorted(_entry_points()))


@cache
def _entry_points() -> Mapping[str, EntryPoint]:
    return MappingProxyType({point.name: point for point in entry_points(group=GROUP)})


def check_plugin(name: str) -> None:
    """Raise ``ScenarioError`` where there is no such localiser, as far as can be told without running its code."""
    limits_here()
    if is_program(name):
        check_program(name)
        return
    point = _entry_point(name)
    _look_here()
    spec = spec_of(point.module)
    if spec is None:
        hint = " (a module is named without .py)" if point.module.endswith(".py") else ""
        raise ScenarioError(
            f"localiser {name!r}: there is no module {point.module!r}{hint}; valid is package.module:Class, importable "
            f"from {Path.cwd()}, or an entry point ({', '.join(installed()) or 'none is installed'})"
        )
    if spec.origin is None or not spec.origin.endswith(".py"):
        return
    try:
        there = top_names(Path(spec.origin))
    except (OSError, SyntaxError, ValueError):
        return  # whoever imports it will tell
    if there is not None and point.attr.partition(".")[0] not in there:
        valid = ", ".join(there) or "nothing: it is empty"
        raise ScenarioError(f"localiser {name!r}: {spec.origin} has no {point.attr!r}; valid are {valid}")


def _entry_point(name: str) -> EntryPoint:
    if name in _entry_points():
        return _entry_points()[name]
    point = EntryPoint(name, name, GROUP)
    module, _, attribute = name.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), *attribute.split("."))):
        raise ScenarioError(f"localiser {name!r} is not valid; it should be package.module:Class")
    return point


def _look_here() -> None:
    """Find modules in the folder where the user stands too, after all others: none may hide a part of the bench."""
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
        importlib.invalidate_caches()


def plugin_digest(name: str) -> str:
    """Digest of all that a user's localiser is made of, and of the bench's code that it builds on."""
    check_plugin(name)
    if is_program(name):
        return program_digest(name)
    return closure_of(_entry_point(name).module).digest


def _code(name: str) -> GuestCode:
    """Code that the guest runs, and the files that it may read: those that its digest is made of."""
    check_plugin(name)
    if is_program(name):
        return GuestCode("", program_of(name), program_files(name))
    point = _entry_point(name)
    files = closure_of(point.module).files
    own = {named: file for named, file in files.items() if named.partition("/")[0] not in PACKAGES}
    return GuestCode(f"{point.module}:{point.attr}", None, own)


class PluginLocaliser:
    """A user's localiser in a process of its own, having learnt a reference drive; each of its answers is looked at.

    It is sent views without their true poses. Raises ``MisbehavedError`` for whatever it does wrong, from its import
    on, and for its end.
    """

    def __init__(self, name: str, reference: Sequence[View]) -> None:
        self._name, self._places, self._count = name, len(reference), 0
        self._limits = limits_here()
        self._guest = Guest(_code(name), self._limits)
        self._most = 2 * 8 * self._places  # places and lost_after
        hello = {"protocol": PROTOCOL, "places": self._places, "seed": SEED}
        begun = "being started" if is_program(name) else "being imported"
        answer = self._asked(begun, packed(Kind.HELLO, hello), Kind.HELLO, self._limits.start)
        self._sensors, self._tells_cost = self._capabilities(answer)
        self._check_sighted(frozenset().union(*(view.sensors for view in reference)))
        where = "learning the reference drive"
        deadline = time.monotonic() + self._limits.learn
        for number, view in enumerate(reference):
            message = view_message(Kind.LEARN, number, view, self._sensors)
            with self._guarded(where):
                self._guest.tell(message, max(0.0, deadline - time.monotonic()))
        self._asked(where, packed(Kind.LEARNT, {}), Kind.OK, max(0.0, deadline - time.monotonic()))

    def reset(self) -> None:
        """Forget all views seen."""
        self._count = 0
        self._asked("reset", packed(Kind.RESET, {}), Kind.OK, self._limits.view)

    def update(self, view: View) -> Belief:
        """Ask about the next view; one that tells no times is timed from outside."""
        where = f"view {self._count}"
        message = view_message(Kind.LOCALISE, self._count, view, self._sensors)
        begin = time.perf_counter()
        answer = self._asked(where, message, Kind.BELIEF, self._limits.view, self._most)
        seconds = time.perf_counter() - begin
        with self._guarded(where):
            kept = checked(belief_of(answer, self._places), self._places, seconds)
            if len(kept.path) > self._count + 1:
                raise NoAnswerError(
                    f"path has {len(kept.path)} places; valid are up to {self._count + 1}, one a view of the drive"
                )
        self._count += 1
        return kept

    def bytes_elsewhere(self) -> int:
        """Bytes that it keeps: as it counts them itself, else all memory that it was seen to have."""
        if not self._tells_cost:
            return self._guest.peak_bytes
        answer = self._asked("cost", packed(Kind.COST, {}), Kind.COST, self._limits.view)
        found = answer.header.get("bytes_kept")
        return found if isinstance(found, int) and 0 <= found < 2**63 else self._guest.peak_bytes

    @property
    def peak_bytes(self) -> int:
        """The most memory that its process was seen to have resident."""
        return self._guest.peak_bytes

    def close(self) -> None:
        """End its process; nothing can be asked any more."""
        self._guest.close()

    def _asked(
        self, where: str, message: Sequence[memoryview], due: Kind, seconds: float, most: int = 0
    ) -> GuestMessage:
        with self._guarded(where):
            return self._guest.ask(message, due, seconds, most)

    def _capabilities(self, answer: GuestMessage) -> tuple[frozenset[str] | None, bool]:
        """Sensors that it wants, None: all, and whether it can tell what it keeps."""
        with self._guarded("hello"):
            version, sensors = answer.header.get("protocol"), answer.header.get("sensors")
            if version != PROTOCOL:
                raise WireError(f"speaks protocol {version!r:.40}; valid is {PROTOCOL}")
            if sensors is not None and not (isinstance(sensors, list) and all(isinstance(one, str) for one in sensors)):
                raise WireError(f"wants sensors {sensors!r:.40}; valid is a list of names")
        return None if sensors is None else frozenset(sensors), answer.header.get("cost") is True

    def _check_sighted(self, there: frozenset[str]) -> None:
        """Raise for a localiser that would see nothing, as it wants none of the sensors that are there."""
        if self._sensors is not None and self._sensors and not self._sensors & there:
            with self._guarded("hello"):
                wanted = ", ".join(sorted(self._sensors))
                raise WireError(
                    f"wants sensors {wanted:.60}, none of which is there; valid are {', '.join(sorted(there))}"
                )

    @contextmanager
    def _guarded(self, where: str) -> Iterator[None]:
        try:
            yield
        except (NoAnswerError, WireError) as mistake:
            error = self._guest.failed(str(mistake))
            raise MisbehavedError(f"{self._name}, {where}: {mistake}", error.said) from None
        except GuestError as error:
            raise MisbehavedError(f"{self._name}, {where}: {error}{self._hint(str(error))}", error.said) from None

    def _hint(self, reason: str) -> str:
        """The rule of confinement that an error of the user's code comes from, where it may be one."""
        kind = reason.removeprefix("raised ").partition(":")[0]
        if kind == "MemoryError":
            return f"; it may hold {self._limits.memory:g} GiB, unless {SETTING} says otherwise"
        if kind in {"FileNotFoundError", "PermissionError", "BlockingIOError"}:
            return "; a localiser reads the files of its own package and starts no process (docs/localiser-protocol.md)"
        return ""
