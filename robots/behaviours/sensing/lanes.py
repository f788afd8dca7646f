"""Lanes side by side along a line, and which of them to take."""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.sensing.room import LOOK
from refseq_bench.robots.robot import Shape

LANE_STEP = 0.05
LANE_MARGIN = 0.10
"""Room at both sides of a lane [m]: a choice."""
ALIKE = 0.3
"""Lanes whose free lengths differ by less are as good as each other [m]: a choice."""
MOST_ASIDE = 1.5
"""The farthest that a robot leaves its line to pass something [m]: a choice."""


def choose_lane(
    points: NDArray[np.float64], along: float, shape: Shape, offsets: NDArray[np.float64], look: float = LOOK
) -> float:
    """The lane nearest to the first of ``offsets`` [m] among those that are free the farthest, up to ``look``.

    ``points`` (n, 2) are (along, across) of the line that the lanes are parallel to, as is the robot's ``along``.
    """
    ahead = points[:, 0] - along
    near = points[(ahead > -shape.behind) & (ahead < shape.ahead + look)]
    ahead = np.maximum(near[:, 0] - along - shape.ahead, 0.0)
    in_lane = np.abs(near[None, :, 1] - offsets[:, None]) < shape.half_width + LANE_MARGIN  # (lanes, points)
    free = np.where(in_lane, ahead[None, :], look).min(axis=1, initial=look)
    good = offsets[free >= free.max() - ALIKE]
    return float(good[np.argmin(np.abs(good - offsets[0]))])


def lane_past(seen: NDArray[np.float64], along: float, shape: Shape, left: float) -> float:
    """The lane [m] to take on a line of which so much way is ``left`` [m], the line itself where it is free.

    ``seen`` (n, 2) are points as (along, across) of the line. What is behind the way's end is not in the way.
    """
    return choose_lane(seen, along, shape, lanes(0.0, -MOST_ASIDE, MOST_ASIDE), min(left, LOOK))


def lanes(preferred: float, rightmost: float, leftmost: float) -> NDArray[np.float64]:
    """Offsets [m] of lanes between two bounds, the preferred one first."""
    others = np.arange(rightmost, leftmost + LANE_STEP / 2, LANE_STEP)
    return np.concatenate([[preferred], others])
