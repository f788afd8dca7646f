"""Points around a robot from its sonars' echoes."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import Ranger, Senses

HISTORY = 1.2
"""Length of a sonar's history of which the median counts, as single readings err [s]: a choice, three times what the
slowest robot takes until a sonar has its turn again."""
SONAR_REACH = 2.0
"""A sonar's echo from farther away is not looked at [m]: a choice."""


class SonarEchoes:
    """Echoes near the robot, as points in the middle of the sonars' cones."""

    def __init__(self, sonars: tuple[Ranger, ...]) -> None:
        self._sonars = np.array(sonars, np.float64).reshape(-1, 3)
        self._heard: deque[tuple[float, NDArray[np.float64]]] = deque()

    def points(self, senses: Senses) -> NDArray[np.float64]:
        """Points (n, 2) [m] in the robot's frame."""
        heard = senses.state.sonar
        if heard is None or len(heard) != len(self._sonars):
            return np.empty((0, 2))
        self._heard.append((senses.now, np.where(np.isnan(heard), np.inf, heard)))
        while senses.now - self._heard[0][0] > HISTORY:
            self._heard.popleft()
        middle = np.quantile([ranges for _, ranges in self._heard], 0.5, axis=0, method="lower")
        near = (middle >= 0) & (middle < SONAR_REACH)
        x, y, bearing = self._sonars[near].T
        return np.stack([x + middle[near] * np.cos(bearing), y + middle[near] * np.sin(bearing)], axis=1)
