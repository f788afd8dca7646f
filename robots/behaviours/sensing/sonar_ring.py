"""Points around a robot from its sonars' echoes."""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import Ranger, Senses
from refseq_bench.robots.behaviours.sensing.sonar_filter import SonarFilter

SONAR_REACH = 2.0
"""A sonar's echo from farther away is not looked at [m]: a choice."""


class SonarEchoes:
    """Echoes near the robot, as points in the middle of the sonars' cones."""

    def __init__(self, sonars: tuple[Ranger, ...]) -> None:
        self._sonars, self._filter = sonars, SonarFilter(sonars)

    def points(self, senses: Senses) -> NDArray[np.float64]:
        """Points (n, 2) [m] in the robot's frame."""
        if not self._filter.look(senses):
            return np.empty((0, 2))
        return cone_middles(self._sonars, self._filter.ranges, SONAR_REACH)


def cone_middles(sonars: tuple[Ranger, ...], ranges: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
    """Points (m, 2) [m] in the robot's frame at the ``ranges`` (n,) that ``sonars`` read, where nearer than ``reach``.

    An echo may come from anywhere in a sonar's cone: its middle is the likeliest.
    """
    near = (ranges >= 0) & (ranges < reach)
    x, y, bearing = np.array(sonars, np.float64).reshape(-1, 3)[near].T
    return np.stack([x + ranges[near] * np.cos(bearing), y + ranges[near] * np.sin(bearing)], axis=1)
