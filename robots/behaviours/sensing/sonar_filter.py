"""Median filter of sonar readings: a single one errs, and may be lost or stray."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import RobotDescription, Senses
from refseq_bench.robots.behaviours.sensing.sonar_ring import HISTORY
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.planar import wrapped

ABEAM = math.radians(30)
"""A sonar looks to a side that looks no farther than this off it: a choice."""


class SonarFilter:
    """The readings of the last moments (``HISTORY``), of each sonar the middle one."""

    def __init__(self, robot: RobotDescription) -> None:
        self._count = len(robot.sonars)
        self._heard: deque[tuple[float, NDArray[np.float64]]] = deque()

    def look(self, senses: Senses) -> None:
        """Take in what is new."""
        heard = senses.state.sonar
        if heard is None or len(heard) != self._count:
            return
        self._heard.append((senses.now, np.where(heard >= 0, heard, np.inf)))
        while senses.now - self._heard[0][0] > HISTORY:
            self._heard.popleft()

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
