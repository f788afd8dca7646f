"""Poses from relations: how stretches of a drive lie to each other, as the files of the SLAM benchmark tell it.

A row says where the robot at one time was as seen from where it was at another: ``t₁ t₂ x y z roll pitch yaw``. Loops
give more relations than there are poses; the poses are those that fit all of them best.
"""

from pathlib import Path

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.trajectories.table import PoseTable, TrajectoryFormat
from refseq.pose_graph import Relations, best_fit, motions_between, moved

FIELDS = 8
"""Numbers in a row."""


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
    # Positions and headings weigh alike, 1 m as 1 rad: the benchmark's relations carry no weights.
    relations = Relations.of(np.searchsorted(group, pairs[inside]), rows[inside][:, [2, 3, 7]])
    poses = best_fit(relations, _along_tree(relations, len(group))).poses
    notes: tuple[str, ...] = (f"poses fit {int(inside.sum())} relations best",)
    if len(group) < len(stamps):
        notes += (f"relations join {len(group)} of {len(stamps)} times; the others have no pose",)
    return PoseTable(path, TrajectoryFormat.RELATIONS, stamps[group], poses, False, notes)


def _along_tree(relations: Relations, count: int) -> NDArray[np.float64]:
    """Poses by as few relations as lead to each from the first one, which is the origin."""
    graph = nx.DiGraph()
    back = motions_between(relations.motions, np.zeros(3))
    for (start, end), there, returning in zip(relations.pairs.tolist(), relations.motions, back, strict=True):
        graph.add_edge(start, end, motion=there)
        if not graph.has_edge(end, start):
            graph.add_edge(end, start, motion=returning)
    poses = np.zeros((count, 3))
    for start, end in nx.bfs_edges(graph, 0):
        poses[end] = moved(poses[start], graph.edges[start, end]["motion"])
    return poses
