"""Plan of a merged map without truth: its paths where joins and odometry put them, and the error against truth."""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq.files import replacing_at
from refseq.map.map import Map
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps.matrix import PICTURES
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN

WIDTH, DPI = 9.0, 120
"""Of the picture [inch], and its dots an inch."""


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


def draw_plan(file: Path, map_: Map) -> None:
    """Draw the paths that are joined: full where a path holds its places, dotted where another path does."""
    paths = [path for path in map_.paths if len(path.poses)]
    spots = np.concatenate([path.poses[:, :2] for path in paths])
    width, height = np.ptp(spots, axis=0) + 1.0
    with mpl.rc_context({**AS_WRITTEN, "font.size": 8, "svg.hashsalt": "refseq"}), replacing_at(file) as drawn:
        figure = Figure(figsize=(WIDTH, float(np.clip(WIDTH * height / width, 3.0, 12.0)) + 0.8), layout="constrained")
        axes = figure.add_subplot()
        for number, path in enumerate(paths):
            x, y = path.poses[:, 0], path.poses[:, 1]
            own = map_.names.index(path.name) if path.name in map_.names else -1
            held = np.where(path.sequences == own, x, np.nan), np.where(path.sequences == own, y, np.nan)
            axes.plot(x, y, ":", color=f"C{number}", linewidth=1)
            axes.plot(*held, "-", color=f"C{number}", linewidth=1.5, label=path.name)
            axes.plot(x[0], y[0], "o", color=f"C{number}", markersize=5)
        axes.set_aspect("equal")
        axes.set_xlabel("[m], from where the first of them began")
        axes.set_title("full: places of the path; dotted: another path holds them; dot: its begin", wrap=True)
        axes.legend()
        figure.savefig(drawn, dpi=DPI, facecolor="white", metadata=PICTURES[file.suffix.lower()])
