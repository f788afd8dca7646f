"""One line of a log and its fields."""

from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.limits import BEAMS, METRES
from refseq.logs.carmen.text import text_lines
from refseq.logs.trajectories.fields import is_number
from refseq.planar import Pose

MOST = 1e12
"""The largest number that is believed of what is neither a time nor a pose."""
LONGEST_COUNT = 9
"""Digits of the largest number of ranges that is looked at."""


@dataclass(frozen=True, slots=True)
class CarmenLine:
    """The fields of one line and its number, from 1; one that is not ``ended`` may have been cut off.

    What it raises tells the field; the line is told by whoever leaves it out.
    """

    number: int
    fields: Sequence[str]
    ended: bool = True

    @property
    def kind(self) -> str:
        """The first field."""
        return self.fields[0]

    def floats(self, start: int, stop: int, most: float = MOST) -> NDArray[np.float64]:
        """The fields from ``start`` to before ``stop`` as numbers up to ``most``, (n,). Raises ``LogError``."""
        try:
            values = np.array(self.fields[start:stop], dtype=float)
        except ValueError as error:
            bad = next(number for number in range(start, stop) if not is_number(self.fields[number]))
            told = f"field {bad} is {self.fields[bad]:.40}; valid are numbers in fields {start} to {stop - 1}"
            raise LogError(told) from error
        if not (wrong := ~(np.abs(values) <= most)).any():
            return values
        bad = int(np.flatnonzero(wrong)[0])
        raise LogError(
            f"field {start + bad} is {self.fields[start + bad]:.40}; valid are finite numbers up to {most:g}"
        )

    def pose(self, start: int) -> Pose:
        """The pose in three fields from ``start`` on: x, y [m], heading [rad]."""
        return Pose(*self.floats(start, start + 3, METRES).tolist())

    def count(self, index: int) -> int:
        """The whole number in field ``index``, which says how many values follow."""
        found = self.fields[index] if len(self.fields) > index else "nothing"
        if not (found.isascii() and found.isdecimal() and len(found) <= LONGEST_COUNT):
            raise LogError(f"field {index} is {found:.40}; valid is the number of ranges")
        BEAMS.check(int(found), "has")
        return int(found)

    def expect(self, length: int, ranges: int | None = None) -> None:
        """Raise ``LogError`` for another number of fields than ``length``, which so many ``ranges`` make."""
        if len(self.fields) != length:
            why = "" if ranges is None else f" for {ranges} ranges"
            raise LogError(f"has {len(self.fields)} fields; valid are {length}{why}")


def lines_in(path: Path) -> Iterator[CarmenLine]:
    """Lines that are neither blank nor comments. Raises ``CutOffError`` where compressed data end before their time."""
    for number, text in enumerate(text_lines(path), 1):
        if number == 1:  # editors of Windows put it before all else
            text = text.removeprefix(BOM_UTF8)
        fields = text.decode("utf-8", errors="replace").split()
        if fields and not fields[0].startswith("#"):
            yield CarmenLine(number, fields, text.endswith(b"\n"))
