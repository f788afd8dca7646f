"""Localisers that users bring: a class by ``package.module:Class``, or by the name of an entry point.

The class is made with the reference drive's views and fits ``refseq.belief.LocaliserProtocol``: ``reset()`` and
``update(view)``. It is given views without their true poses, whose arrays cannot be written to, and each of its answers
is looked at. Until it is asked none of its code is run: what hangs or breaks in it does so in the process that asks it.
"""

import importlib
import sys
import sysconfig
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, LocaliserProtocol
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.imports.closure import PACKAGES, ROOT, closure_of, spec_of
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.plugin_answers import NoAnswerError, checked
from refseq_bench.scenarios.methods.plugin_sources import top_names

GROUP = "refseq.localisers"
"""Group of entry points."""

LocaliserFactory = Callable[[Sequence[View]], LocaliserProtocol]
T = TypeVar("T")
Scalar = TypeVar("Scalar", bound=np.generic)


class MisbehavedError(Exception):
    """A localiser raised, or gave an answer that is none: its own failure, not the bench's. One line says which."""


def is_plugin(name: str) -> bool:
    """Tell whether a method's name is that of a user's localiser. A baseline's name always means the baseline."""
    return ":" in name or (name in installed() and name not in BASELINES)


def installed() -> tuple[str, ...]:
    """Names of the localisers that installed packages bring."""
    return tuple(sorted(_entry_points()))


@cache
def _entry_points() -> Mapping[str, EntryPoint]:
    return MappingProxyType({point.name: point for point in entry_points(group=GROUP)})


def check_plugin(name: str) -> None:
    """Raise ``ScenarioError`` where there is no such localiser, as far as can be told without running its code."""
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
    return closure_of(_entry_point(name).module).digest


class PluginLocaliser:
    """A user's localiser, having learnt a reference drive; each of its answers is looked at.

    Raises ``MisbehavedError`` for whatever the user's code does wrong, from its import on.
    """

    def __init__(self, name: str, reference: Sequence[View]) -> None:
        self._name, self._places, self._count = name, len(reference), 0
        maker = self._guarded("being imported", lambda: _loaded(name))
        views = [blindfolded(view) for view in reference]
        self._inner = self._guarded("learning the reference drive", lambda: maker(views))
        for part in ("reset", "update"):
            if not callable(getattr(self._inner, part, None)):
                raise MisbehavedError(f"{name} has no {part}(); valid is what fits refseq.belief.LocaliserProtocol")

    def reset(self) -> None:
        """Forget all views seen."""
        self._count = 0
        self._guarded("reset", self._inner.reset)

    def update(self, view: View) -> Belief:
        """Ask about the next view; one that tells no times is timed from outside."""
        where, shown = f"view {self._count}", blindfolded(view)
        begin = time.perf_counter()
        belief = self._guarded(where, lambda: self._inner.update(shown))
        seconds = time.perf_counter() - begin
        kept = self._guarded(where, lambda: checked(belief, self._places, seconds))
        self._count += 1
        return kept

    def _guarded(self, where: str, call: Callable[[], T]) -> T:
        try:
            return call()
        except NoAnswerError as mistake:
            raise MisbehavedError(f"{self._name}, {where}: {mistake}") from None
        except (Exception, SystemExit) as error:
            raise MisbehavedError(
                f"{self._name}, {where}: raised {type(error).__name__}: {_line(error)}{_place(error)}"
            ) from error


def _loaded(name: str) -> LocaliserFactory:
    _look_here()
    made: LocaliserFactory = _entry_point(name).load()
    if not callable(made):
        raise TypeError(f"{name} is no class but {type(made).__name__}")
    return made


def blindfolded(view: View) -> View:
    """A view without its true pose, whose arrays cannot be written to: others are asked about the same ones."""
    images = MappingProxyType({camera: _sealed(image) for camera, image in view.images.items()})
    scan = None if view.scan is None else replace(view.scan, ranges=_sealed(view.scan.ranges))
    return replace(view, images=images, scan=scan, truth=None)


def _sealed(array: NDArray[Scalar]) -> NDArray[Scalar]:
    sealed = array.view()
    sealed.setflags(write=False)
    return sealed


def _line(error: BaseException) -> str:
    return " ".join(str(error).split()) or "no message"


def _place(error: BaseException) -> str:
    """Where the user's code was when it raised: the innermost line that is not the bench's, Python's or a package's."""
    frames = reversed(traceback.extract_tb(error.__traceback__))
    lines = (f" ({Path(one.filename).name}, line {one.lineno})" for one in frames if _written_by_user(one.filename))
    return next(lines, "")


def _written_by_user(file: str) -> bool:
    others = (sysconfig.get_path("stdlib"), sysconfig.get_path("purelib"), *(str(ROOT / name) for name in PACKAGES))
    return not file.startswith(("<", *others))
