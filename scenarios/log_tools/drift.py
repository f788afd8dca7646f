"""Drift of an odometer against true poses: a metre, a turn, and what is left to chance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import dead_reckoned
from refseq.pose_graph import cuts, ways_along
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.travel import moved, positions

STEP = 0.5
"""Poses nearer to the last one kept are left out [m]: true poses that tremble would lengthen the way."""
PIECE = 5.0
"""The way is cut into pieces of so many metres: shorter ones show how true poses tremble, longer ones are too few."""
USUAL = math.radians(1.0)
"""Chance that is usual [rad/√m]: pieces far beyond it hardly weigh, such as those in which true poses are missing."""
NORMAL = 1.4826
"""Standard deviation of normal errors over the median of their sizes."""
FEWEST = 6
"""Pieces below which nothing is told: two figures are fitted to them."""


@dataclass(frozen=True, slots=True)
class OdometryDrift:
    """Errors of an odometer over a true ``way`` [m].

    Over most pieces of the way its heading is off by ``bend`` · length [rad/m] + ``turn`` · true turn + chance, of
    standard deviation ``walk`` · √length [rad/√m]. It shows ``length`` metres for each true one, less 1. ``off`` is how
    far it is from the truth at most [m], from the first pose on.
    """

    way: float
    bend: float
    turn: float
    walk: float
    length: float
    off: float


def drift_of(views: Sequence[View], name: str) -> OdometryDrift:
    """Compare the odometry of views with their truth. Raises ``ScenarioError`` where there is too little of either."""
    known = [index for index, view in enumerate(views) if view.truth is not None]
    odometer = dead_reckoned(views)
    if not known or not len(odometer):
        raise ScenarioError(f"{name}: has no {'odometry' if known else 'true poses'}; valid is a drive with both")
    return odometry_drift(positions([view.truth for view in views if view.truth]), odometer[known], name)


def odometry_drift(truth: NDArray[np.float64], odometer: NDArray[np.float64], name: str) -> OdometryDrift:
    """Fit the errors of an odometer: both (n, 3) of x, y [m], heading [rad]. Raises ``ScenarioError`` as above."""
    from scipy.optimize import least_squares  # slow to import: other figures of a log are told without it

    heading, error = np.unwrap(truth[:, 2]), np.unwrap(odometer[:, 2] - truth[:, 2])
    kept = moved(truth, STEP)
    along = ways_along(truth[kept])
    pieces = cuts(along, PIECE)
    if len(pieces) <= FEWEST:
        raise ScenarioError(
            f"{name}: {along[-1]:.1f} m of true poses tell no drift; valid are {FEWEST * (PIECE + STEP):g} m and more"
        )
    length, turned, off = (np.diff(of[pieces]) for of in (along, heading[kept], error[kept]))  # (pieces,)
    causes = np.stack([length, turned], axis=1)
    fitted = least_squares(
        lambda errors: (off - causes @ errors) / np.sqrt(length), (0.0, 0.0), loss="soft_l1", f_scale=USUAL
    )
    (bend, turn), left = fitted.x, fitted.fun
    shown = ways_along(odometer[kept])[-1] / along[-1] - 1
    walk = float(NORMAL * np.median(np.abs(left))) * math.sqrt(len(left) / (len(left) - 2))
    return OdometryDrift(float(along[-1]), float(bend), float(turn), walk, float(shown), _farthest(truth, odometer))


def _farthest(truth: NDArray[np.float64], odometer: NDArray[np.float64]) -> float:
    """Largest distance of the odometer from the truth when both begin at one pose [m]."""
    turn = truth[0, 2] - odometer[0, 2]
    axes = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    apart = (odometer[:, :2] - odometer[0, :2]) @ axes.T - (truth[:, :2] - truth[0, :2])
    return float(np.hypot(*apart.T).max())
