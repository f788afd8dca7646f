"""Units of times since 1970, told by how large their numbers are."""

from decimal import Decimal
from typing import NamedTuple


class EpochUnit(NamedTuple):
    """A unit of ``seconds`` each: numbers of ``least`` and more are in it, unless they are in a finer one."""

    name: str
    seconds: float
    least: int


NANOSECONDS = EpochUnit("nanoseconds", 1e-9, 10**17)
"""Its least is of the year 1973: in any coarser unit it would be a time beyond all clocks."""

EPOCH_UNITS = (
    NANOSECONDS,
    EpochUnit("microseconds", 1e-6, 10**14),
    EpochUnit("milliseconds", 1e-3, 10**11),
    EpochUnit("seconds", 1.0, 10**8),
)
"""The finest first."""


def epoch_unit(number: float | Decimal) -> EpochUnit | None:
    """Return the unit of a time since 1970, None for a number that is too small for one."""
    return next((unit for unit in EPOCH_UNITS if number >= unit.least), None)
