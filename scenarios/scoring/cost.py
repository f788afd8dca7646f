"""Costs of a method beside the time a view takes: the bytes that it keeps, and the memory of the process."""

import gc
import sys
import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

CODE = (type, types.ModuleType, types.FunctionType, types.MethodType, types.BuiltinFunctionType)
STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


@runtime_checkable
class KeepsElsewhere(Protocol):
    """A stand-in for something in another process."""

    def bytes_elsewhere(self) -> int:
        """Bytes that are kept there."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of learning a reference drive and answering a query drive.

    ``learn_s`` and ``answer_s`` [s, wall]; ``places`` learnt; ``bytes_kept`` by the localisers; ``features`` of the
    map, None where the method has no binary features; ``peak_bytes``: the most memory that the process had resident.
    """

    learn_s: float
    answer_s: float
    places: int
    bytes_kept: int
    features: int | None
    peak_bytes: int


def bytes_kept(*things: object) -> int:
    """Bytes of all arrays, texts and numbers that some objects hold, each counted once.

    Modules, classes and functions do not count, and what lies behind a library's own handle cannot be seen. What keeps
    things in another process tells how many by a method ``bytes_elsewhere``.
    """
    seen: set[int] = set()
    total, left = 0, list(things)
    while left:
        thing = left.pop()
        if id(thing) in seen or isinstance(thing, CODE):
            continue
        seen.add(id(thing))
        if isinstance(thing, KeepsElsewhere):
            total += thing.bytes_elsewhere()
            continue
        if isinstance(thing, np.ndarray) and thing.base is not None:
            left.append(thing.base)  # a view of an array keeps the whole of it
            continue
        total += thing.nbytes if isinstance(thing, np.ndarray) else sys.getsizeof(thing)
        left.extend(_inside(thing))
    return total


def _inside(thing: object) -> Iterable[object]:
    if isinstance(thing, Mapping):
        return [*thing.keys(), *thing.values()]
    if isinstance(thing, list | tuple | set | frozenset):
        return thing
    names = (name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ()))
    slots = [getattr(thing, name) for name in names if hasattr(thing, name)]
    return [*getattr(thing, "__dict__", {}).values(), *slots]


def forget_peak() -> None:
    """Begin anew to count the most resident memory; where the system lets nobody, the peak is that of the process."""
    gc.collect()
    try:
        CLEAR.write_text("5")
    except OSError:
        return


def peak_bytes() -> int:
    """The most memory that was resident since ``forget_peak``."""
    try:
        lines = STATUS.read_text().splitlines()
    except OSError:
        import resource

        return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0)
