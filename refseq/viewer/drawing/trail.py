"""Path travelled so far, in a bounded number of points."""

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose

MOST = 512
"""Points that are kept at most."""


class Trail:
    """Takes poses one by one; when it is full, every other one is dropped, and from then on every other one left out.

    The newest pose is always its end.
    """

    def __init__(self, most: int = MOST) -> None:
        self._kept: list[tuple[float, float]] = []
        self._most = most
        self._stride = 1
        self._count = 0
        self._last: tuple[float, float] | None = None

    def add(self, pose: Pose) -> None:
        """Go on to a pose."""
        self._last = (pose.x, pose.y)
        if self._count % self._stride == 0:
            self._kept.append(self._last)
        self._count += 1
        if len(self._kept) == self._most:
            del self._kept[1::2]
            self._stride *= 2

    @property
    def points(self) -> NDArray[np.float64]:
        """The path, (n, 2) [m], n ≤ ``most``."""
        ended = [] if not self._kept or self._kept[-1] == self._last or self._last is None else [self._last]
        return np.array(self._kept + ended).reshape(-1, 2)
