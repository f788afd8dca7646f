"""Where a robot's laser is, and where in the level world its beams end when the robot is pitched."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FLOOR = 0.10
"""Points lower than this are taken for the floor [m]: a choice. A pitch that is 0.4° off, as ours can
be, moves the end of a beam by 2 cm at 3 m and by 4 cm at 6 m, beyond which nobody looks."""


@dataclass(frozen=True, slots=True)
class Mounting:
    """Where the laser of a level robot is: ``ahead`` of the axle and ``height`` above the floor [m].

    ``axle`` [m] is the axle's height above the floor: the robot pitches about it.
    """

    ahead: float
    height: float
    axle: float

    def ends(self, ranges: NDArray[np.float64], bearings: NDArray[np.float64], pitch: float) -> NDArray[np.float64]:
        """Ends of beams (n, 3) [m]: ahead of the axle, to its left, above the floor; ``pitch`` [rad], nose down."""
        forward, left = self.ahead + ranges * np.cos(bearings), ranges * np.sin(bearings)
        cos, sin, over = math.cos(pitch), math.sin(pitch), self.height - self.axle
        return np.stack([forward * cos + over * sin, left, self.axle + over * cos - forward * sin], axis=1)
