"""Attacks by name: what each promises, how often it is tried, and the function that tries.

An attack is one function with a decorator, in a module of ``attacks/``, which is found there::

    @attack(family="files", promise="A log that was cut off is read up to its last whole record", tries=200, short=2)
    def cut_off_log(seed: int, folder: Path) -> str | None:
        ...          # make the input of this seed in the folder, which is kept if it makes something fall
        return None  # survived; or a line that tells what fell
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Attempt:
    """The end of one try: a line that tells what fell, or None; and figures by unit, as ``{"s of CPU": 1.2}``.

    Of each figure the table shows the largest of all tries.
    """

    fell: str | None = None
    figures: Mapping[str, float] = field(default_factory=dict)


AttackFunction = Callable[[int, Path], Attempt | str | None]
"""Of a try's seed and a new folder, in which it leaves its input. ``unittest.SkipTest`` says why it cannot run here."""
AnyFunction = TypeVar("AnyFunction", bound=AttackFunction)


@dataclass(frozen=True)
class Attack:
    """An attack: a sentence about what holds, tried ``tries`` times in full and ``short`` times in the quick suite.

    ``short`` is 0 where one try takes more than a few seconds of the processor.
    A try that takes longer than ``limit`` [s] on the clock has fallen.
    """

    name: str
    family: str
    promise: str
    tries: int
    short: int
    function: AttackFunction
    limit: float = 600.0


_attacks: dict[str, Attack] = {}


def register(one: Attack) -> None:
    """Add an attack. Raises ValueError where its name is taken."""
    if one.name in _attacks:
        raise ValueError(f"there are two attacks '{one.name}'")
    _attacks[one.name] = one


def attack(
    *, family: str, promise: str, tries: int, short: int, name: str = "", limit: float = Attack.limit
) -> Callable[[AnyFunction], AnyFunction]:
    """Register a function as an attack, by default under its own name with dashes."""

    def add(function: AnyFunction) -> AnyFunction:
        own = name or function.__name__.replace("_", "-")
        register(Attack(own, family, promise, tries, short, function, limit))
        return function

    return add


def attacks() -> dict[str, Attack]:
    """All attacks by name, in the order of family and name, found in the modules of ``attacks/``."""
    for file in sorted((HERE / "attacks").rglob("*.py")):
        parts = file.relative_to(HERE).with_suffix("").parts
        importlib.import_module(".".join(("tests", HERE.name, *parts)))
    return dict(sorted(_attacks.items(), key=lambda item: (item[1].family, item[0])))
