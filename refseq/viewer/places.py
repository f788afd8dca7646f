"""The places that beliefs are about: where they are, what was seen there, and who holds them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.errors import RefseqError
from refseq.map.map import Map
from refseq.map.sequence import ReferenceSequence
from refseq.planar import Pose
from refseq.view import View

NEAR = 1.5
"""A view farther than this from every place [m] is off the path: no place is the true one."""


@dataclass(frozen=True)
class Places:
    """K places, those of all ``sequences`` one behind the other.

    ``poses`` are the true poses, for drawing only. ``views`` are the K views that the places were learnt from, with
    their pictures, or nothing where those are not at hand; without ``sequences`` no feature is known.
    """

    poses: Sequence[Pose | None]
    sequences: Sequence[ReferenceSequence] = ()
    views: Sequence[View] = ()

    def __post_init__(self) -> None:
        held = sum(map(len, self.sequences))
        for count, what in ((held, "places in the map"), (len(self.views), "views of places")):
            if count not in (0, len(self.poses)):
                raise RefseqError(f"{count} {what} for {len(self.poses)} poses; valid is one each, or none")

    @classmethod
    def of(cls, map_: Map, views: Sequence[View] = ()) -> "Places":
        """The places of a map; ``views`` are of the drives it was learnt from, where they fit its places.

        A map that was reduced or merged has other places than its drive had views: those pictures are left out.
        """
        return cls(map_.poses, map_.sequences, views if len(views) == len(map_) else ())

    @classmethod
    def along(cls, views: Sequence[View]) -> "Places":
        """The views of a drive as places, whose features nobody learnt."""
        return cls([view.truth for view in views], (), views)

    def __len__(self) -> int:
        return len(self.poses)

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """Number of each sequence's first place, and of all places: (S + 1,)."""
        return np.cumsum([0, *map(len, self.sequences)])

    def held(self, place: int) -> tuple[ReferenceSequence, int]:
        """The sequence that holds a place, and the number that it has there."""
        sequence = self.holder(place)
        return self.sequences[sequence], place - int(self.first[sequence])

    def holder(self, place: int) -> int:
        """Number of the sequence that holds a place."""
        return int(np.searchsorted(self.first, place, side="right")) - 1

    @cached_property
    def known(self) -> NDArray[np.intp]:
        """Places with a pose."""
        return np.flatnonzero([pose is not None for pose in self.poses])

    @cached_property
    def table(self) -> NDArray[np.float64]:
        """Poses of the ``known`` places, (n, 3): x, y [m], heading [rad]."""
        return np.array([(pose.x, pose.y, pose.heading) for pose in self.poses if pose]).reshape(-1, 3)

    @property
    def lines(self) -> list[NDArray[np.float64]]:
        """Positions of the ``known`` places, (n, 2) [m] for each sequence: none leads on to the next one."""
        return np.split(self.table[:, :2], np.searchsorted(self.known, self.first[1:-1]))

    def nearest(self, pose: Pose | None) -> int | None:
        """The place nearest to a pose that looks the same way within 90°; ``None`` if none is within ``NEAR``."""
        if pose is None or not len(self.known):
            return None
        distance = np.hypot(self.table[:, 0] - pose.x, self.table[:, 1] - pose.y)
        distance[np.cos(self.table[:, 2] - pose.heading) <= 0] = math.inf
        nearest = int(np.argmin(distance))
        return int(self.known[nearest]) if distance[nearest] <= NEAR else None
