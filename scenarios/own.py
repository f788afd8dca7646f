"""Localisers that users bring: a class by ``package.module:Class``, or by the name of an entry point.

The class is made with the reference drive's views and fits ``refseq.belief.Localiser``: ``reset()``, ``update(view)``.
True poses are taken out of all views before it sees them.
"""

import hashlib
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TypeVar

import numpy as np

from refseq.belief import Belief, Localiser
from refseq.view import View
from scenarios.errors import ScenarioError

GROUP = "refseq.localisers"
"""Group of entry points."""

Maker = Callable[[Sequence[View]], Localiser]
T = TypeVar("T")


class MisbehavedError(Exception):
    """A localiser raised, or gave an answer that is none: its own failure, not the bench's. One line says which."""


def is_own(name: str) -> bool:
    """Whether a method's name is that of a user's localiser."""
    return ":" in name or name in installed()


def installed() -> tuple[str, ...]:
    """Names of the localisers that installed packages bring."""
    return tuple(sorted(entry_points(group=GROUP).names))


def load_own(name: str) -> Maker:
    """What makes a user's localiser. Raises ``ScenarioError`` where it cannot be imported or fits no localiser."""
    found = _entry_point(name)
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))  # a module in the folder where the user stands is found, as by `python -m`
    try:
        maker = found.load()
    except Exception as error:
        raise ScenarioError(
            f"localiser {name!r} cannot be imported: {type(error).__name__}: {_line(error)}; valid is "
            "package.module:Class, importable from here, or the name of an entry point"
        ) from error
    if not callable(maker) or not all(callable(getattr(maker, part, None)) for part in ("reset", "update")):
        raise ScenarioError(
            f"localiser {name!r} is no class with reset() and update(view), see refseq.belief.Localiser"
        )
    made: Maker = maker
    return made


def _entry_point(name: str) -> EntryPoint:
    if name in installed():
        return next(iter(entry_points(group=GROUP, name=name)))
    module, _, attribute = name.partition(":")
    if not (module and attribute):
        raise ScenarioError(f"localiser {name!r} is not valid; it should be package.module:Class")
    return EntryPoint(name, f"{module}:{attribute}", GROUP)


def own_digest(name: str) -> str:
    """Digest of the source that a user's localiser is made of: its module, and those of the package that it is in."""
    load_own(name)
    module = sys.modules[_entry_point(name).module]
    file = Path(str(getattr(module, "__file__", "")))
    beside = sorted(file.parent.rglob("*.py")) if "." in module.__name__ else [file]
    digest = hashlib.sha256()
    for path in beside:
        digest.update(path.read_bytes())
    return digest.hexdigest()


class OwnLocaliser:
    """A user's localiser, having learnt a reference drive; each of its answers is looked at.

    All that it does may raise ``MisbehavedError``.
    """

    def __init__(self, name: str, reference: Sequence[View]) -> None:
        self._name, self._places, self._count = name, len(reference), 0
        blind = [replace(view, truth=None) for view in reference]
        self._inner = self._guarded("learning the reference drive", lambda: load_own(name)(blind))

    def reset(self) -> None:
        """Forget all views seen."""
        self._count = 0
        self._guarded("reset", self._inner.reset)

    def update(self, view: View) -> Belief:
        """Ask about the next view."""
        where = f"view {self._count}"
        belief = self._guarded(where, lambda: self._inner.update(replace(view, truth=None)))
        if mistake := _mistake(belief, self._places):
            raise MisbehavedError(f"{self._name}, {where}: {mistake}")
        self._count += 1
        return belief

    def _guarded(self, where: str, call: Callable[[], T]) -> T:
        try:
            return call()
        except ScenarioError:
            raise
        except Exception as error:
            raise MisbehavedError(f"{self._name}, {where}: raised {type(error).__name__}: {_line(error)}") from error


def _mistake(belief: object, places: int) -> str:
    """What is wrong with an answer; nothing for one that can be scored."""
    if not isinstance(belief, Belief):
        return f"answered {type(belief).__name__}; valid is refseq.belief.Belief"
    probabilities = np.asarray(belief.places)
    if probabilities.shape != (places,):
        return f"places has shape {probabilities.shape}; valid is ({places},), one a reference view"
    if not (np.isfinite(probabilities).all() and (probabilities >= 0).all()):
        return "places holds what is no probability (nan, infinite or negative)"
    if abs(float(probabilities.sum()) - 1) > 1e-6:
        return f"places sums to {float(probabilities.sum()):.6g}; valid is 1"
    if not 0 <= belief.lost <= 1:
        return f"lost is {belief.lost}; valid is 0 to 1"
    if not 0 <= belief.best < places:
        return f"best is {belief.best}; valid is 0 to {places - 1}"
    return ""


def _line(error: BaseException) -> str:
    return " ".join(str(error).split()) or "no message"
