"""Names of picture files: their natural order, and the times that they may be."""

import re
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

PICTURES = (".png", ".jpg", ".jpeg")
"""Endings of the pictures that are read."""

EPOCHS = ((10**17, 1e-9), (10**14, 1e-6), (10**11, 1e-3), (10**8, 1.0))
"""Numbers from so many on are times since 1970, in units of so many seconds; smaller ones number the pictures."""


def natural(path: Path) -> tuple[tuple[int, str], ...]:
    """Key for sorting names as a person would: picture 9 before picture 10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((int(part), "") if part.isdecimal() else (0, part) for part in parts)


def in_order(files: Sequence[Path]) -> tuple[tuple[Path, ...], NDArray[np.float64] | None]:
    """Files in the order of their times [s], or of their names; the times are None where the names are none."""
    named = sorted(files, key=natural)
    if not all(re.fullmatch(r"\d{1,20}(\.\d{1,12})?", file.stem) for file in named):
        return tuple(named), None
    stamps = {file: Decimal(file.stem) for file in named}
    first = min(stamps.values(), default=Decimal(0))
    unit = next((seconds for least, seconds in EPOCHS if first >= least), None)
    if unit is None or len(set(stamps.values())) < len(stamps):
        return tuple(named), None
    ordered = sorted(named, key=stamps.__getitem__)
    return tuple(ordered), np.array([float(stamps[file]) for file in ordered]) * unit
