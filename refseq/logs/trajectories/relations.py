"""Poses from relations: how stretches of a drive lie to each other, as the files of the SLAM benchmark tell it.

A row says where the robot at one time was as seen from where it was at another: ``t₁ t₂ x y z roll pitch yaw``. Loops
give more relations than there are poses; the poses are those that fit all of them best.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from refseq.errors import LogError
from refseq.logs.trajectories.table import PoseTable, TrajectoryFormat
from refseq.planar import Pose, in_world

FIELDS = 8
"""Numbers in a row."""

MOST_STEPS, SMALL_STEP = 20, 1e-9
"""Least squares end after so many steps, or with a step that moves no pose by more [m, rad]."""


@dataclass(frozen=True, slots=True)
class Relations:
    """``pairs`` (n, 2) number the stamps that a relation joins; ``motions`` (n, 3) are x, y [m] and yaw [rad]."""

    pairs: NDArray[np.intp]
    motions: NDArray[np.float64]


def poses_from_relations(path: Path, rows: NDArray[np.float64]) -> PoseTable:
    """Poses of the stamps that relations join, in the frame of the first; ``rows`` (n, 8) are the file's.

    Of several groups that no relation joins the largest is taken, which the table's notes tell. Raises ``LogError``
    where the rows relate nothing.
    """
    stamps, numbers = np.unique(rows[:, :2], return_inverse=True)
    pairs = numbers.reshape(-1, 2)
    graph = nx.Graph(pairs[pairs[:, 0] != pairs[:, 1]].tolist())
    if not graph:
        raise LogError(f"{path}: relates no two times; valid are rows of two times, x, y, z, roll, pitch and yaw")
    largest: set[int] = max(nx.connected_components(graph), key=len)
    group = np.array(sorted(largest))
    inside = np.isin(pairs[:, 0], group) & (pairs[:, 0] != pairs[:, 1])
    relations = Relations(np.searchsorted(group, pairs[inside]), rows[inside][:, [2, 3, 7]])
    notes: tuple[str, ...] = (f"poses fit {int(inside.sum())} relations best",)
    if len(group) < len(stamps):
        notes += (f"relations join {len(group)} of {len(stamps)} times; the others have no pose",)
    return PoseTable(path, TrajectoryFormat.RELATIONS, stamps[group], best_fit(relations, len(group)), False, notes)


def best_fit(relations: Relations, count: int) -> NDArray[np.float64]:
    """Poses (count, 3) that fit the relations with the least squares, by Gauss and Newton; the first is the origin.

    Positions and headings weigh alike, 1 m as 1 rad: the benchmark's relations carry no weights.
    """
    poses = _along_tree(relations, count)
    for _ in range(MOST_STEPS):
        errors, slopes = _linearised(relations, poses)
        free = slopes[:, 3:]  # the first pose stays where it is
        step = spsolve(sparse.csc_matrix(free.T @ free), -free.T @ errors)
        poses[1:] += step.reshape(-1, 3)
        if np.abs(step).max() < SMALL_STEP:
            break
    return poses


def _along_tree(relations: Relations, count: int) -> NDArray[np.float64]:
    """Poses by as few relations as lead to each from the first one."""
    graph = nx.DiGraph()
    for (start, end), (x, y, yaw) in zip(relations.pairs.tolist(), relations.motions.tolist(), strict=True):
        graph.add_edge(start, end, motion=(x, y, yaw))
        back = in_world((-x, -y), Pose(0, 0, -yaw)).tolist()
        if not graph.has_edge(end, start):
            graph.add_edge(end, start, motion=(*back, -yaw))
    poses = np.zeros((count, 3))
    for start, end in nx.bfs_edges(graph, 0):
        poses[end] = _moved(poses[start].tolist(), graph.edges[start, end]["motion"])
    return poses


def _moved(pose: Sequence[float], motion: Sequence[float]) -> tuple[float, float, float]:
    x, y = in_world(motion[:2], Pose(*pose)).tolist()
    return x, y, pose[2] + motion[2]


def _linearised(relations: Relations, poses: NDArray[np.float64]) -> tuple[NDArray[np.float64], sparse.csr_matrix]:
    """Errors (3n,) of the relations at these poses, and their slopes (3n, 3·count)."""
    start, end = relations.pairs.T
    cos, sin = np.cos(poses[start, 2]), np.sin(poses[start, 2])
    east, north = (poses[end, :2] - poses[start, :2]).T
    ahead, left = cos * east + sin * north, cos * north - sin * east
    found = np.column_stack([ahead, left, poses[end, 2] - poses[start, 2]])
    errors = found - relations.motions
    errors[:, 2] = np.remainder(errors[:, 2] + math.pi, 2 * math.pi) - math.pi
    one, none = np.ones_like(cos), np.zeros_like(cos)
    by_start = [[-cos, -sin, left], [sin, -cos, -ahead], [none, none, -one]]
    by_end = [[cos, sin, none], [-sin, cos, none], [none, none, one]]
    rows, columns, values = [], [], []
    for numbers, block in ((start, by_start), (end, by_end)):
        for row, entries in enumerate(block):
            for column, value in enumerate(entries):
                rows.append(3 * np.arange(len(start)) + row)
                columns.append(3 * numbers + column)
                values.append(value)
    where = (np.concatenate(rows), np.concatenate(columns))
    return errors.ravel(), sparse.csr_matrix((np.concatenate(values), where), shape=(errors.size, poses.size))
