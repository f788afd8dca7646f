"""True places of a mission's way: for scoring and rewards only, a robot never sees them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose

if TYPE_CHECKING:  # scores measure distances to lines, and load no plan for it
    from refseq.missions.path import MissionPath
    from refseq.missions.plan import Plan

AHEAD = 0.5
"""Distance behind and ahead of a place that gives the direction of a way there [m]."""


@dataclass(frozen=True)
class TrueWay:
    """A ``way``, and where its places really are, (n, 2) [m]."""

    way: "MissionPath"
    places: NDArray[np.float64]

    def position(self, along: float) -> NDArray[np.float64]:
        """The true place so far along the way, (2,) [m]."""
        return np.array([np.interp(along, self.way.along, self.places[:, axis]) for axis in (0, 1)])

    def stretch(self, start: float, end: float) -> NDArray[np.float64]:
        """The true places from one to another, (m, 2) [m]; one where they are the same."""
        between = self.places[(self.way.along > start) & (self.way.along < end)]
        ends = [self.position(start)] if end <= start else [self.position(start), *between, self.position(end)]
        return np.array(ends)

    def where(self, plan: "Plan", number: int) -> NDArray[np.float64]:
        """Where an order of a plan may begin: what lasts until a place is reached on all of its stretch."""
        order = plan.orders[number]
        return self.stretch(order.at, plan.end_of(number) if order.travels else order.at)

    def pose(self, along: float) -> Pose:
        """The true place so far along the way, looking along it."""
        x, y = self.position(along)
        behind, ahead = self.position(along - AHEAD), self.position(along + AHEAD)
        return Pose(float(x), float(y), float(np.arctan2(*(ahead - behind)[::-1])))

    def nearest(self, pose: Pose) -> float:
        """Distance along the way of the place nearest to a pose [m]."""
        return float(self.way.along[int(np.hypot(*(self.places - (pose.x, pose.y)).T).argmin())])


def distance_to(line: NDArray[np.float64], point: NDArray[np.float64]) -> float:
    """From a point (2,) to a line (m, 2) of one point or more [m]."""
    if len(line) == 1:
        return float(np.hypot(*(line[0] - point)))
    legs = np.diff(line, axis=0)
    share = np.einsum("ij,ij->i", point - line[:-1], legs) / np.maximum((legs**2).sum(axis=1), 1e-12)
    nearest = line[:-1] + np.clip(share, 0.0, 1.0)[:, None] * legs
    return float(np.hypot(*(nearest - point).T).min())
