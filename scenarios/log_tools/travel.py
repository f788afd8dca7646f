"""Figures of a driven path: how long, how large, how winding, and where it comes back to."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, wrapped
from refseq.pose_graph import ways_along

STEP = 0.1
"""Poses nearer to the last one kept are left out [m]: an odometer that trembles at rest drives nowhere."""

TURN = math.radians(60)
"""The heading has to change by so much, within ``CORNER``, for a turn [rad]."""

CORNER = 3.0
"""Way in which a turn has to be made [m]: a hall that bends slowly has none."""

REVISIT_WITHIN, REVISIT_AFTER, REVISIT_HEADING = 1.5, 10.0, math.radians(45)
"""A place is come back to within so much [m], so much farther along the path [m], with so similar a heading [rad]."""


@dataclass(frozen=True, slots=True)
class Travel:
    """A path's length, the width and height of the box around it [m], turns to either side, and its revisits.

    ``revisited`` is the share of the path that runs where it ran before, in the same direction.
    """

    length: float
    width: float
    height: float
    left_turns: int
    right_turns: int
    revisited: float


def positions(poses: Sequence[Pose]) -> NDArray[np.float64]:
    """Poses as rows of x, y [m] and heading [rad], (n, 3)."""
    return np.array([(pose.x, pose.y, pose.heading) for pose in poses], dtype=np.float64).reshape(-1, 3)


def travel(path: NDArray[np.float64]) -> Travel:
    """The figures of a path (n, 3) of x, y [m] and heading [rad]; a path of no pose is nowhere."""
    if not len(path):
        return Travel(0.0, 0.0, 0.0, 0, 0, 0.0)
    kept_at = moved(path)
    kept = path[kept_at]
    along = ways_along(kept)
    width, height = np.ptp(path[:, :2], axis=0)
    left, right = _turns(along, np.unwrap(path[:, 2])[kept_at])
    back = _revisits(along, kept)
    revisited = float(back.mean()) if len(kept) > 1 else 0.0
    return Travel(float(along[-1]), float(width), float(height), left, right, revisited)


def moved(path: NDArray[np.float64], step: float = STEP) -> NDArray[np.intp]:
    """Indices of the poses that lie ``step`` [m] or more from the last one taken."""
    kept, (x, y) = [0], path[0, :2]
    for index, (east, north) in enumerate(path[:, :2].tolist()):
        if math.hypot(east - x, north - y) >= step:
            kept.append(index)
            x, y = east, north
    return np.array(kept)


def _turns(along: NDArray[np.float64], heading: NDArray[np.float64]) -> tuple[int, int]:
    """Turns to the left and to the right: the heading changed by ``TURN`` within ``CORNER``, each counted once."""
    left = right = 0
    before = 0  # the last turn ended here
    for now in range(len(along)):
        begin = max(before, int(np.searchsorted(along, along[now] - CORNER)))
        changes = heading[now] - heading[begin : now + 1]
        if np.abs(changes).max() >= TURN:
            to_left = changes[np.abs(changes).argmax()] > 0
            left, right, before = left + to_left, right + (not to_left), now
    return int(left), int(right)


def _revisits(along: NDArray[np.float64], path: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Marks of the poses that lie where the path was before, in the same direction; (n,)."""
    from scipy.spatial import cKDTree  # slow to import: a log's topics are told without it

    tree, back = cKDTree(path[:, :2]), np.zeros(len(path), dtype=bool)
    for index, near in enumerate(tree.query_ball_point(path[:, :2], REVISIT_WITHIN)):
        earlier = np.array([one for one in near if along[one] < along[index] - REVISIT_AFTER], dtype=int)
        apart = np.abs(wrapped(path[earlier, 2] - path[index, 2]))
        back[index] = bool((apart < REVISIT_HEADING).any())
    return back
