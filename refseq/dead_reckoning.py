"""The way of a drive by its odometry alone."""

from collections.abc import Sequence
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, after_motion
from refseq.view import View


def dead_reckoned(views: Sequence[View], start: Pose | None = None) -> NDArray[np.float64]:
    """Poses of views by their odometry, (K, 3): x, y [m] and heading [rad]; (0, 3) without any.

    The first is at ``start``, by default the origin.
    """
    if not any(view.distance or view.turn for view in views[1:]):
        return np.zeros((0, 3))
    begin = start or Pose(0.0, 0.0, 0.0)
    poses = accumulate(views[1:], lambda pose, view: after_motion(pose, view.distance, view.turn), initial=begin)
    return np.array([(pose.x, pose.y, pose.heading) for pose in poses])
