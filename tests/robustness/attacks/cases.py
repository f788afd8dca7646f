"""Inputs that once made something fall, replayed: ``cases/FORMAT/FILE`` goes to the function that reads its format.

A family of attacks on a format says in its module how one of its inputs is tried::

    @replays("mcap")
    def try_log(input: Path, folder: Path) -> str | None: ...
"""

from collections.abc import Callable
from pathlib import Path

from tests.robustness.attack import HERE, Attack, Attempt, register

Replay = Callable[[Path, Path], Attempt | str | None]
"""Of a case and a new folder."""
_replays: dict[str, Replay] = {}


def replays(form: str) -> Callable[[Replay], Replay]:
    """Register the function that tries an input of a format; it answers as an attack does."""

    def add(function: Replay) -> Replay:
        _replays[form] = function
        return function

    return add


def cases() -> list[Path]:
    """All cases, in the order of their names."""
    return sorted(path for path in (HERE / "cases").glob("*/*") if not path.name.startswith("."))


def replay(seed: int, folder: Path) -> Attempt | str | None:
    """Try a case again, by its number."""
    case = cases()[seed]
    return _replays[case.parent.name](case, folder)


if count := len(cases()):
    register(Attack("cases", "cases", "An input that once made something fall does so no more", count, count, replay))
