"""Where in the plan a join lies, as the joins page draws it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.map.map import Map
from refseq.pose_graph import motions_between, moved


@dataclass(frozen=True)
class DrawnWay:
    """A line of the plan: its ``look``, a class of the page's style, ``points`` as SVG has them, and ``width``."""

    look: str
    points: str
    width: int


@dataclass(frozen=True)
class DrawnMark:
    """A letter at a spot of the plan."""

    letter: str
    x: float
    y: float


@dataclass(frozen=True)
class DrawnPlan:
    """Lines and marks of a plan, the ``box`` that they lie in, the height of letters [m], and what the plan is."""

    ways: tuple[DrawnWay, ...]
    marks: tuple[DrawnMark, ...]
    box: str
    letters: float
    caption: str


def drawn_plan(map_: Map, paths: tuple[int, int], pairs: NDArray[np.intp], marked: Mapping[str, int]) -> DrawnPlan:
    """Both paths with the stretches of a join: in the frame of all joins, or as this join alone lays them.

    ``marked`` are views of the first path, by their letters.
    """
    poses = [map_.paths[path].poses for path in paths]
    if all(len(each) for each in poses):
        caption = "Where all joins that were made put the paths."
        ways = [_way("way", path.poses, 1) for path in map_.paths if len(path.poses)]
    else:
        caption = "Where this join alone would put the paths, by their odometry."
        poses = [map_.track(map_.paths[path]) for path in paths]
        if not all(len(each) for each in poses):
            return DrawnPlan((), (), "0 0 1 1", 1.0, "No odometry, no plan.")
        if paths[0] == paths[1]:
            caption = "Where the path's odometry alone puts it."
        else:
            i, j = pairs[len(pairs) // 2]
            poses[1] = moved(poses[0][i], motions_between(poses[1][j], poses[1]))
        ways = [_way("way", each, 1) for each in poses]
    drawn = np.concatenate([*poses, *(p.poses for p in map_.paths if len(p.poses) and len(ways) > len(paths))])
    for look, each, views in zip(("way-its", "way-mine"), poses[::-1], pairs.T[::-1], strict=True):
        ways.append(_way(look, each[views.min() : views.max() + 1], 6 if look == "way-its" else 2))
    letters = max(float(np.ptp(drawn[:, :2], axis=0).max()), 5.0) / 14
    marks = tuple(DrawnMark(letter, *_rounded(poses[0][view])) for letter, view in marked.items())
    return DrawnPlan(tuple(ways), marks, _box(drawn, letters), letters, caption)


def _rounded(pose: NDArray[np.float64]) -> tuple[float, float]:
    return round(float(pose[0]), 2), round(-float(pose[1]), 2)


def _way(look: str, poses: NDArray[np.float64], width: int) -> DrawnWay:
    return DrawnWay(look, " ".join(f"{x:.2f},{-y:.2f}" for x, y in poses[:, :2].tolist()), width)


def _box(poses: NDArray[np.float64], letters: float) -> str:
    margin = 1.5 * letters + 0.5
    (left, below), (width, height) = poses[:, :2].min(axis=0), np.ptp(poses[:, :2], axis=0)
    return f"{left - margin:.1f} {-below - height - margin:.1f} {width + 2 * margin:.1f} {height + 2 * margin:.1f}"
