"""Stretches of a drive that lead off a map, where no place of it is seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import way_along
from refseq.errors import MapError
from refseq.view import View


@dataclass(frozen=True, slots=True)
class AstraySettings:
    """Rules of what leads off a map.

    A view is off it where being lost is more probable than ``lost`` in hindsight. A new path takes in ``overlap`` [m]
    of the drive before and behind, which it shares with the map; stretches that this would make meet are one path, so
    that what looks like a place of the map for a while parts no corridor. A path that leads less than ``least`` [m] off
    the map is not worth one.
    """

    lost: float = 0.5
    overlap: float = 15.0
    least: float = 5.0

    def __post_init__(self) -> None:
        """Raise ``MapError`` for a probability that is none, and for lengths that are not finite and at least 0."""
        if not 0 <= self.lost <= 1:
            raise MapError(f"lost is {self.lost}; valid is a probability from 0 to 1")
        for name in ("overlap", "least"):
            if not 0 <= (length := getattr(self, name)) < np.inf:
                raise MapError(f"{name} is {length} m; valid is a length of 0 m or more")


@dataclass(frozen=True, slots=True)
class Astray:
    """Views of a drive that lead off a map, from the first to the last: ``metres`` of them do.

    ``path`` are the views of a path that has them and what is before and behind.
    """

    views: range
    metres: float
    path: range


def astray(views: Sequence[View], lost: NDArray[np.float64], settings: AstraySettings) -> list[Astray]:
    """Stretches of a drive that lead off a map, in their order; ``lost`` (V,) is P(lost) at each of its views."""
    way = way_along(views)
    off = np.flatnonzero(lost > settings.lost)
    parts = np.flatnonzero(np.diff(way[off]) > 2 * settings.overlap) + 1
    found = [_astray(way, one, settings.overlap) for one in np.split(off, parts) if len(one)]
    return [one for one in found if one.metres >= settings.least]


def _astray(way: NDArray[np.float64], off: NDArray[np.intp], overlap: float) -> Astray:
    """The stretch of some views off the map; ``way`` (V,) is how far each view of the drive lies along it [m]."""
    first, last = int(off[0]), int(off[-1])
    steps = np.diff(way[off])[np.diff(off) == 1]
    within = np.flatnonzero((way >= way[first] - overlap) & (way <= way[last] + overlap))
    return Astray(range(first, last + 1), float(steps.sum()), range(int(within[0]), int(within[-1]) + 1))
