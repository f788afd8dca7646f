"""Median filter of sonar readings: a single one errs, and may be lost or stray."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import Ranger, RobotDescription, Senses
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.planar import wrapped

HISTORY = 1.2
"""Length of a sonar's history of which the median counts, as single readings err [s]: a choice, three times what the
slowest robot takes until a sonar has its turn again."""
ABEAM = math.radians(30)
"""A sonar looks to a side that looks no farther than this off it: a choice."""


class SonarFilter:
    """The readings of the last moments (``HISTORY``), of each of ``sonars`` the middle one; no range is a far one."""

    def __init__(self, sonars: tuple[Ranger, ...]) -> None:
        self._count = len(sonars)
        self._heard: deque[tuple[float, NDArray[np.float64]]] = deque()

    def look(self, senses: Senses) -> bool:
        """Take in what is new; false where the sonars told nothing."""
        heard = senses.state.sonar
        if heard is None or len(heard) != self._count:
            return False
        self._heard.append((senses.now, np.where(heard >= 0, heard, np.inf)))
        while senses.now - self._heard[0][0] > HISTORY:
            self._heard.popleft()
        return True

    @property
    def steady(self) -> bool:
        """True if it has listened for long enough that a stray reading does not count."""
        return bool(self._heard) and self._heard[-1][0] - self._heard[0][0] > HISTORY / 2

    @property
    def ranges(self) -> NDArray[np.float64]:
        """The middle reading of each sonar, (n,) [m]."""
        return np.quantile([ranges for _, ranges in self._heard], 0.5, axis=0, method="lower")


def abeam(robot: RobotDescription, side: int) -> NDArray[np.intp]:
    """Numbers of the sonars that look to a side: +1 left, -1 right; raises ``RobotsError`` where none does."""
    off = [abs(wrapped(ranger.bearing - side * math.pi / 2)) for ranger in robot.sonars]
    found = np.flatnonzero(np.array(off) < ABEAM)
    if not len(found):
        raise RobotsError(f"no sonar looks to the {'left' if side > 0 else 'right'}: valid is a robot with some there")
    return found
