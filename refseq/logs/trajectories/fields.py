"""Fields of a line of a trajectory file: commas, semicolons, tabs or spaces stand between them."""

import csv
import re
from collections.abc import Sequence
from datetime import datetime

DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
SEPARATORS = (";", ",")
"""Separators beside white space: where a line has both of them, its commas are those of numbers."""


def fields_of(line: str) -> Sequence[str]:
    """The fields of a row of numbers."""
    words = line.replace('"', " ").split()
    if len(words) > 1 and all(map(DECIMAL_COMMA.fullmatch, words)):
        return words
    found = _between(line, SEPARATORS)
    return words if found is None else found


def names_of(header: str, count: int) -> Sequence[str]:
    """The names of a header for ``count`` fields, of which each may be of several words; empty for one of others."""
    for names in (_between(header, SEPARATORS), _between(header, ("\t",)), header.split()):
        if names is not None and len(names) == count:
            return names
    return ()


def is_separated(line: str) -> bool:
    """Tell whether more than white space stands between the fields of a row."""
    return any(separator in line for separator in SEPARATORS)


def is_number(field: str) -> bool:
    """Tell whether a field is written as a number."""
    try:
        float(field)
    except ValueError:
        return False
    return True


def decimal_comma(fields: Sequence[str]) -> str:
    """The first number that is written with a comma; empty without one."""
    return next((field for field in fields if DECIMAL_COMMA.fullmatch(field)), "")


def clock_time(text: str) -> datetime | None:
    """A date and time as ISO 8601 writes them; None for another text."""
    try:
        return datetime.fromisoformat(text) if ":" in text else None
    except ValueError:
        return None


def _between(line: str, separators: Sequence[str]) -> Sequence[str] | None:
    """The fields between the first of some separators that a line has; None where it has none."""
    separator = next((one for one in separators if one in line), None)
    if separator is None:
        return None
    if '"' not in line:
        return [field.strip() for field in line.split(separator)]
    # Many programs put quotation marks around every field; a return within a line is none of its ends.
    fields = next(csv.reader([line.replace("\r", " ")], delimiter=separator, skipinitialspace=True))
    return [field.strip() for field in fields]
