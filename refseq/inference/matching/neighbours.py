"""Neighbours of places along a path: how many steps they lie apart, and gaps over which none are neighbours.

Places that follow each other are neighbours where the robot drove on from view to view. While it stood, all its views
are of one place; and merging, which gives a common stretch to another sequence, leaves places beside each other that
may be tens of metres apart.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from refseq.inference.paths import PathBounds, usual_step

REACH = 3
"""Places to both sides that may share a place's features."""
GAP, STEPS = 4.0, 5.0
"""A gap is a way to the next place of more than so many metres and so many usual steps: what is seen at its one end is
then not to be expected at the other. With smaller values every second view that was missed would be one; with larger
ones places on both sides of what a merge took out lend each other their features."""


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Places by their ``step``, (K,), rising: one more than the place before, the same while the robot stood.

    Over a gap it rises by more than ``REACH``. ``first`` and ``last`` (K,) are the ends of each place's stretch, which
    has no gap.
    """

    step: NDArray[np.intp]
    first: NDArray[np.int32]
    last: NDArray[np.int32]

    @classmethod
    def of(cls, along: NDArray[np.float64]) -> Self:
        """Neighbours on a path over ``along`` (K,) [m], rising; one of no length, without odometry, is as even."""
        ways = np.diff(along)
        if not (ways > 0).any():
            return cls.even(len(along))
        gap = ways > max(GAP, STEPS * usual_step(along))
        bounds = PathBounds.of(along, (*np.flatnonzero(gap).tolist(), -1))
        step = np.cumsum([0, *np.where(gap, REACH + 1, ways > 0)])
        return cls(step, bounds.first.astype(np.int32), bounds.last.astype(np.int32))

    @classmethod
    def even(cls, K: int) -> Self:
        """Neighbours by their numbers alone: each place is a step from the one before."""
        return cls(np.arange(K), np.zeros(K, np.int32), np.full(K, K - 1, np.int32))

    @property
    def stretches(self) -> int:
        """Number of stretches without a gap."""
        return len(np.unique(self.first))

    @property
    def views(self) -> NDArray[np.intp]:
        """Number of places by step, 0 for one that no place has: several while the robot stood."""
        return np.bincount(self.step)
