"""Names of picture files: their natural order, and the times that they may be."""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.logs.epoch import epoch_unit

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".webp")
"""Endings of the pictures that are read."""

LATEST = 4_102_444_800.0
"""The year 2100 [s]: what would be later is a date in digits, as 20260131120000, or a number of another kind."""
MOST = 0.9
"""Share of the names that have to tell a time for the others, as a ``preview.jpg``, to be left out."""
NAME = re.compile(
    r"(?P<before>(?:.*?\D)??)(?P<time>\d{9,20})(?:\.(?P<part>\d{1,12})|[_-](?P<split>\d{9}|\d{6}|\d{3}))?(?P<after>\D.*|)"
)
"""A time in a name: ``1760000000123``, ``1760000000.123``, ``1760000000_123``, with text before and after it."""


def natural(path: Path) -> tuple[tuple[int, str], ...]:
    """Key for sorting names as a person would: picture 9 before picture 10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((int(part), "") if part.isdecimal() else (0, part) for part in parts)


@dataclass(frozen=True, slots=True)
class OrderedPictures:
    """Pictures in the order of their ``times`` (n,) [s], or of their names, where the times are None.

    ``without`` are those whose names tell no time as the others' do; beside times they are left out.
    """

    files: tuple[Path, ...]
    times: NDArray[np.float64] | None = None
    without: tuple[Path, ...] = ()


def in_order(files: Sequence[Path]) -> OrderedPictures:
    """Order files by the times in their names where most tell one, with the same text around; else by their names."""
    named = sorted(files, key=natural)
    groups: dict[tuple[str, str], dict[Path, re.Match[str]]] = defaultdict(dict)
    for file in named:
        if match := NAME.fullmatch(file.stem):
            groups[match["before"], match["after"]][file] = match
    found = max(groups.values(), key=len, default={})
    without = tuple(file for file in named if file not in found)
    times = _times(list(found.values()))
    if times is None:
        return OrderedPictures(tuple(named))
    if len(found) < MOST * len(named):
        return OrderedPictures(tuple(named), None, without)
    order = np.argsort(times, kind="stable")
    files = list(found)
    return OrderedPictures(tuple(files[k] for k in order.tolist()), times[order], without)


def _times(names: Sequence[re.Match[str]]) -> NDArray[np.float64] | None:
    """Times [s] by names; None where they are none, or not one each."""
    stamps = [Decimal(f"{name['time']}.{name['part'] or name['split'] or 0}") for name in names]
    first = min(stamps, default=Decimal(0))
    unit = epoch_unit(first)  # smaller numbers count the pictures
    if unit is None or float(max(stamps)) * unit.seconds > LATEST or len(set(stamps)) < len(stamps) or _counts(names):
        return None
    return np.array([float(stamp) for stamp in stamps]) * unit.seconds


def _counts(names: Sequence[re.Match[str]]) -> bool:
    """Tell whether a number behind whole seconds counts the pictures: a part of a second would fall now and then."""
    splits = [name["split"] for name in names]
    return len(splits) > 1 and all(a and b and int(a) < int(b) for a, b in pairwise(splits))
