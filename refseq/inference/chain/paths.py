"""Bounds of the paths that a chain's places lie on, one path behind the other."""

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
        gaps = np.delete(np.diff(along), last[:-1])
        first = np.concatenate([[0], last[:-1] + 1])
        return cls(first[path], last[path], float(np.median(gaps)) if len(gaps) else 0.0)
