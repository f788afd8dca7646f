"""Truth that only repeats the odometry, as the pose beside each scan of many raw logs does."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import dead_reckoned
from refseq.logs.recording import TimedData, views_of
from refseq.planar import Pose, wrapped
from refseq.view import View

SAME_HEADING, SAME_PLACE = 1e-4, 1.0
"""Odometry and truth that differ nowhere more than this [rad] [m] are one path, told twice: a sensor's place on the
robot moves it a little, and turns nothing."""


def repeats_odometry(views: Sequence[View]) -> bool:
    """Tell whether the true poses of all views are one path with the odometry."""
    true = [view.truth for view in views if view.truth is not None]
    if len(true) < len(views) or len(views) < 2:
        return False
    return one_path(dead_reckoned(views, true[0]), _retold(true))


def _retold(true: Sequence[Pose]) -> NDArray[np.float64]:
    """The path of true poses, (n, 3), as an odometer's distances and turns tell it, which lose what it slips aside."""
    return dead_reckoned(list(views_of(TimedData(0.0, odometry=pose) for pose in true)), true[0])


def one_path(way: NDArray[np.float64], true: NDArray[np.float64]) -> bool:
    """Tell odometry and truth, (n, 3) each, that always head alike and lie on each other."""
    if not 0 < len(way) == len(true):
        return False
    apart = np.abs(wrapped(way[:, 2] - true[:, 2]))
    return bool(apart.max() < SAME_HEADING and np.hypot(*(way - true)[:, :2].T).max() < SAME_PLACE)
