"""The way of a drive by its odometry alone."""

from collections.abc import Sequence
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, after_motion
from refseq.view import View


def reckoned_poses(views: Sequence[View], start: Pose | None = None) -> list[Pose]:
    """Pose of each view, at least one, by the motions up to it, headings not wrapped; the first is at ``start``."""
    begin = start or Pose(0.0, 0.0, 0.0)
    return list(accumulate(views[1:], lambda at, view: after_motion(at, view.distance, view.turn), initial=begin))


def way_along(views: Sequence[View]) -> NDArray[np.float64]:
    """Way from the first view to each [m], (K,), whichever way the robot drove; at least one view."""
    return np.cumsum([0.0, *(abs(view.distance) for view in views[1:])])


def dead_reckoned(views: Sequence[View], start: Pose | None = None) -> NDArray[np.float64]:
    """Poses of views by their odometry, (K, 3): x, y [m] and heading [rad]; (0, 3) without any.

    The first is at ``start``, by default the origin.
    """
    if not any(view.distance or view.turn for view in views[1:]):
        return np.zeros((0, 3))
    return np.array([(pose.x, pose.y, pose.heading) for pose in reckoned_poses(views, start)])
