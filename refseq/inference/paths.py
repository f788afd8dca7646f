"""Places along paths: the bounds of paths that lie one behind the other, and the usual step from place to place."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class PathBounds:
    """For each place the ``first`` and ``last`` place of its path, (K,), and the usual ``gap`` between places [m]."""

    first: NDArray[np.intp]
    last: NDArray[np.intp]
    gap: float

    @classmethod
    def of(cls, along: NDArray[np.float64], ends: tuple[int, ...]) -> Self:
        """Bounds of the paths over ``along`` (K,) [m]; ``ends`` are their last places, rising."""
        K = len(along)
        last = np.array(ends) % K
        path = np.searchsorted(last, np.arange(K))
        first = np.concatenate([[0], last[:-1] + 1])
        return cls(first[path], last[path], usual_step(along, ends))


def usual_step(along: NDArray[np.float64], ends: tuple[int, ...] = (-1,)) -> float:
    """The median distance from one place to the next of its path [m], of those that the robot drove; 0 without any.

    ``ends`` are the last places of the paths over ``along`` (K,) [m], rising. A robot that stood saw one place many
    times: were these steps counted, a drive that stood for more than half of its views would have none.
    """
    gaps = np.delete(np.diff(along), np.array(ends[:-1], np.intp))
    driven = gaps[gaps > 0]
    return float(np.median(driven)) if len(driven) else 0.0
