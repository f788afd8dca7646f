"""Two scans laid on each other, to one scale, as the joins page draws them: green the one, orange the other."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.scans import ScannedPath
from refseq.pose_graph import moved

REACH = 10.0
"""Range of drawn scans [m]."""
LEAST = 8.0, 4.0
"""Size of the drawn area at least [m], along and aside: a narrow one would blow noise up."""
MARGIN = 0.5
"""Margin around it [m]."""


@dataclass(frozen=True)
class DrawnBox:
    """An area of a drawing [dm]: its left upper corner and its size, y downwards."""

    left: float
    top: float
    width: float
    height: float

    @property
    def text(self) -> str:
        """The same as SVG has it."""
        return f"{self.left:.0f} {self.top:.0f} {self.width:.0f} {self.height:.0f}"


@dataclass(frozen=True)
class DrawnScans:
    """Scans of a pair as SVG paths in decimetres, the robot of the first at (0, 0) looking right.

    ``share`` is that of the beams that meet the same walls, in words.
    """

    share: str
    mine: str
    its: str
    box: DrawnBox


def drawn_scans(
    one: ScannedPath, other: ScannedPath, pair: tuple[int, int], motion: NDArray[np.float64], share: float
) -> DrawnScans:
    """Scans of a pair of views, the other's at the pose ``motion`` (3,) in the one's."""
    mine, theirs = one.walls(pair[0]).points, other.walls(pair[1]).points
    there = moved(motion, np.column_stack([theirs, np.zeros(len(theirs))]))[:, :2]
    near = [points[np.hypot(*points.T) <= REACH] for points in (mine, there)]
    return DrawnScans(f"{share:.1%}", _dots(near[0]), _dots(near[1]), _box(np.concatenate([*near, np.zeros((1, 2))])))


def _dots(points: NDArray[np.float64]) -> str:
    """Points about the robot, which looks right, as an SVG path of dots [dm]."""
    return "".join(f"M{10 * x:.1f} {-10 * y:.1f}h0" for x, y in points.tolist())


def _box(points: NDArray[np.float64]) -> DrawnBox:
    """The area that holds all points, with a margin."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    more = np.maximum(np.array(LEAST) - (high - low), 0) / 2
    (left, below), (right, above) = low - more, high + more
    return DrawnBox(10 * left, -10 * above, 10 * (right - left), 10 * (above - below))
