"""The way of a mission: places that were learnt, one behind the other, and what is known of the way between them."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.behaviours import begun
from refseq.map.paths.annotations import PathDoor

if TYPE_CHECKING:  # each takes a tenth of a second to import, and who asks for a way has loaded a map, or made a route
    from refseq.atlas.routes import Route
    from refseq.map.map import Map
    from refseq.map.paths.path import MapPath


@dataclass(frozen=True)
class MissionPath:
    """A way through a map.

    ``places`` (n,) are numbered as beliefs number them, ``along`` (n,) is how far each is from the way's start [m].
    ``behaviours`` (n,) say what was done from each place on when it was learnt, empty: it was gone on with; the first
    may be empty, too, where nobody knows. ``doors`` are those along it, in their order. ``twins`` (m, 2) are pairs of
    the map's places that loops make one: a belief in either speaks for both.
    """

    places: NDArray[np.intp]
    along: NDArray[np.float64]
    behaviours: tuple[str, ...]
    doors: tuple[PathDoor, ...]
    twins: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 2), np.intp))

    @cached_property
    def held(self) -> "HeldPlaces":
        """Places that stand for positions of the way: its own, and behind them their twins."""
        partners: dict[int, list[int]] = defaultdict(list)
        for one, other in self.twins.tolist():
            partners[one].append(other)
            partners[other].append(one)
        ways = zip(self.places.tolist(), self.along.tolist(), strict=True)
        twins = [(twin, at) for place, at in ways for twin in partners[place]]
        places = np.array([twin for twin, _ in twins], np.intp)
        along = np.array([at for _, at in twins], np.float64)
        return HeldPlaces(np.concatenate([self.places, places]), np.concatenate([self.along, along]))

    @property
    def length(self) -> float:
        """From the first place to the last [m]."""
        return float(self.along[-1])


class HeldPlaces(NamedTuple):
    """``places`` (h,) and how far along the way each is [m], (h,); one that the way comes by twice is there twice."""

    places: NDArray[np.intp]
    along: NDArray[np.float64]


def path_along(map_: "Map", path: "MapPath | None" = None) -> MissionPath:
    """A whole path of a map, by default the first; a door that was only seen ahead of its end is none along it."""
    path = path or map_.paths[0]
    behaviours = path.annotations.behaviours or ("",) * len(path)
    doors = _doors_between(path.annotations.doors, *path.along[[0, -1]].tolist())
    return MissionPath(map_.numbered(path), path.along, behaviours, doors, map_.loops)


def _doors_between(doors: Sequence[PathDoor], start: float, end: float) -> tuple[PathDoor, ...]:
    """Those of a stretch of a path, from ``start`` to ``end`` [m] along it, as they lie along the stretch."""
    return tuple(replace(door, along=door.along - start) for door in doors if start <= door.along <= end)


def path_of(map_: "Map", route: "Route") -> MissionPath:
    """A route through a map; where it changes paths, it goes on as that path was driven there.

    Where one is already there it is a single place, also of the two that a loop makes one.
    """
    paths = {path.name: path for path in map_.paths}
    legs = [_leg(map_, paths[leg.path], leg.first, leg.last) for leg in route.legs]
    return joined(legs) if legs else MissionPath(route.places[:1], np.zeros(1), ("",), (), map_.loops)


def joined(legs: Sequence[MissionPath]) -> MissionPath:
    """Ways one behind the other: each begins at the place where the last one ended."""
    whole = legs[0]
    for leg in legs[1:]:
        far = whole.length
        doors = (replace(door, along=door.along + far) for door in leg.doors)
        whole = MissionPath(
            np.concatenate([whole.places, leg.places[1:]]),
            np.concatenate([whole.along, leg.along[1:] + far]),
            # Where it goes over, what is done is what was done on the path that it goes over to.
            (*whole.behaviours[:-1], *leg.behaviours),
            (*whole.doors, *doors),
            whole.twins,
        )
    return whole


def _leg(map_: "Map", path: "MapPath", first: int, last: int) -> MissionPath:
    whole = path_along(map_, path)
    views = slice(first, last + 1)
    start, end = whole.along[[first, last]].tolist()
    behaviours = list(whole.behaviours[views])
    here = begun(behaviours[0])
    if not here or here[0][0] > 0:
        before = [behaviour for words in whole.behaviours[:first] for _, behaviour in begun(words)]
        behaviours[0] = "; ".join([*before[-1:], *filter(None, behaviours[:1])])
    doors = _doors_between(whole.doors, start, end)
    return MissionPath(whole.places[views], whole.along[views] - start, tuple(behaviours), doors, whole.twins)
