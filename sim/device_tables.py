"""Tables of a device's figures: how a file may write them, and how a wrong one is refused."""

import math
from typing import Annotated

from pydantic import ConfigDict, Field

from refseq_bench.sim.errors import SimError

Number = Annotated[float, Field(strict=True)]
"""A figure in a file: a number, no text that looks like one."""
Whole = Annotated[int, Field(strict=True)]
"""A whole number in a file."""
TABLE = ConfigDict(extra="forbid")
"""Reading of a file's table into a dataclass: no key that the dataclass does not have."""


def require(holds: bool, key: str, value: object, valid: str) -> None:
    """Raise ``SimError`` that names key, value and what is valid, unless it ``holds``."""
    if not holds:
        raise SimError(f"{key} = {value} is not {valid}")


def require_positive(table: str, **figures: float) -> None:
    """Raise ``SimError`` for the first figure of a table that is not above 0 and finite."""
    for name, value in figures.items():
        require(0.0 < value < math.inf, f"{table}.{name}", value, "> 0 and finite")


def require_share(table: str, **figures: float) -> None:
    """Raise ``SimError`` for the first figure of a table that is not above 0 and at most 1."""
    for name, value in figures.items():
        require(0.0 < value <= 1.0, f"{table}.{name}", value, "> 0 and <= 1")


def require_limits(table: str, **figures: tuple[float, float]) -> None:
    """Raise ``SimError`` for the first pair of a table that is not 0 < least <= most."""
    for name, (least, most) in figures.items():
        require(0.0 < least <= most < math.inf, f"{table}.{name}", (least, most), "0 < least <= most")
