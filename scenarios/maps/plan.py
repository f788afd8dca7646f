"""Plan of a merged map without truth: its paths where joins and odometry put them, and the error against truth."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.map.map import Map
from refseq_bench.scenarios.errors import ScenarioError


@dataclass(frozen=True, slots=True)
class PlanError:
    """Error of places' poses against the truth, after the rigid alignment that makes it least (ATE, as evo has it).

    ``rmse`` and ``worst`` [m] over ``places`` whose true poses are known, ``share`` the former over the paths' length.
    """

    places: int
    rmse: float
    worst: float
    share: float


def check_plan(map_: Map, file: Path) -> None:
    """Raise ``ScenarioError`` for a map of which no two paths are joined with odometry, and none has a loop."""
    if not any(len(path.poses) for path in map_.paths):
        raise ScenarioError(
            f"{file}: no two of its paths are joined with odometry, and none comes back to itself, so that they have "
            "no plan; valid is a map that `refseq map merge` has made of drives with odometry"
        )


def plan_error(map_: Map) -> PlanError | None:
    """The error against the truth; None where fewer than two places have a true pose."""
    pairs = [(p, q) for p, q in zip(map_.joined_poses, map_.poses, strict=True) if p and q]
    if len(pairs) < 2:
        return None
    found, true = (np.array([(pose.x, pose.y) for pose in side]) for side in zip(*pairs, strict=True))
    off = np.hypot(*(aligned(found, true) - true).T)
    length = math.fsum(path.length for path in map_.paths if len(path.poses))
    rmse = float(np.sqrt(np.mean(off**2)))
    return PlanError(len(pairs), rmse, float(off.max()), rmse / max(length, 1e-9))


def aligned(points: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 2) turned and shifted to lie as near as can be to others (n, 2) (Umeyama 1991, without scale)."""
    middle, its = points.mean(axis=0), to.mean(axis=0)
    u, _, v = np.linalg.svd((points - middle).T @ (to - its))
    turn = u @ np.diag([1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return np.asarray((points - middle) @ turn + its)
