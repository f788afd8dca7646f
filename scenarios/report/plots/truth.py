"""True positions of views, and the band of right answers in a plot over views."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.report.plots.style import TRUTH
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance


def positions_of(views: Sequence[View]) -> NDArray[np.float64]:
    """Collect the true positions (n, 2) [m], nan where unknown."""
    truths = [view.truth for view in views]
    return np.array([(pose.x, pose.y) if pose else (math.nan, math.nan) for pose in truths]).reshape(-1, 2)


def true_along(pose: Pose | None, path: ReferencePath, wide: Tolerance, drive: slice | None = None) -> float:
    """Find the true position along the reference path [m], nan for a view that is off the map or has no truth.

    Of several drives it is along the one that is given, or along the nearest.
    """
    if pose is None or not path.within(pose, wide)[drive or slice(None)].any():
        return math.nan
    return path.project(pose, drive)


def draw_truth(axes: Axes, views: Sequence[View], path: ReferencePath, wide: Tolerance, carried: Sequence[int]) -> None:
    """A band from the tolerance before the true position to that behind; broken off the map, and where a kidnap ended.

    Of several drives each that passes there has its own; one without true poses has none.
    """
    for drive in path.stretches:
        known = drive.start + np.flatnonzero(np.isfinite(path.along[drive]))
        if not len(known):
            continue
        true = np.array([true_along(view.truth, path, wide, drive) for view in views])
        over = np.insert(np.arange(len(true), dtype=float), carried, np.nan)
        low, high = (
            np.insert(np.interp(true + offset, path.along[known], known), carried, np.nan)
            for offset in (-wide.distance, wide.distance)
        )
        for edge in (low, high):
            axes.plot(over, edge, color=TRUTH, alpha=0.6, linewidth=0.6, zorder=1)
        axes.fill_between(over, low, high, color=TRUTH, alpha=0.35, linewidth=0, zorder=1)
