"""Errors for input that cannot be used: this package's own family, and every room's in one clause.

Each room has a family of its own, for the rooms know nothing of each other and so share no base. ``ValueError`` is none
either: pydantic's validators turn it into their own, and code that reads numbers catches it.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FAMILIES = {
    "refseq": "RefseqError",
    "refseq_bench.worlds": "WorldsError",
    "refseq_bench.robots": "RobotsError",
    "refseq_bench.sim": "SimError",
}


class ScenarioError(Exception):
    """A scenario, a run or its answers cannot be used: the message names the value, its place and what is valid."""


class UnwritableError(ScenarioError):
    """A file or a folder of results cannot be written."""


def input_errors() -> tuple[type[Exception], ...]:
    """Collect the rooms' families of errors, so that a single ``except`` clause catches bad input of any room.

    A room that was never imported has raised nothing, and may not be importable here: it is left out.
    """
    loaded = ((sys.modules.get(f"{room}.errors"), family) for room, family in FAMILIES.items())
    return (ScenarioError, *(getattr(module, family) for module, family in loaded if module is not None))


@contextmanager
def named(table: str) -> Iterator[None]:
    """Name the table in which something is wrong."""
    try:
        yield
    except input_errors() as error:
        raise ScenarioError(f"{table}: {error}") from error


@contextmanager
def about(file: Path, name: str = "") -> Iterator[None]:
    """Name the file that an error is about, where it does not begin with it, or with a ``name`` for it.

    The localiser knows views and maps, and not the files that they are from.
    """
    try:
        yield
    except input_errors() as error:
        if str(error).startswith((f"{file}: ", f"{name or file}: ")):
            raise
        raise ScenarioError(f"{file}: {error}") from error
