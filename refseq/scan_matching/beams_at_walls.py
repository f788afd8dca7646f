"""Ends of beams at straight pieces of wall of other scans: many pairs of scans at once, both ways.

One pair of scans is a few hundred beams, for which a step of least squares is a hundred calls of a few microseconds,
whatever it reckons. So the beams of all pairs stand one behind the other, each with the number of its way: of pair p,
way 2 p leads the second scan's beams to the first one's walls, and way 2 p + 1 back.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.pose_graph import motions_between
from refseq.scan_matching.lines import WallLines

OFF_WALL, FACING = 0.3, 0.9
"""An end of a beam is not of a piece of wall that ends so far from it [m], or whose normals have a smaller product."""


class BeamsAtWalls(NamedTuple):
    """Ends of beams at walls, n of them, by rising ``way`` (n,).

    ``errors`` (n,) are their distances from the walls [m], ``normals`` (2, n) those of the walls, and ``turns`` (n,)
    the variance of a wall's direction [rad²]. ``arms`` (2, n) lead from the scan's middle to the ends. All are in the
    frame of the walls.
    """

    way: NDArray[np.intp]
    errors: NDArray[np.float64]
    normals: NDArray[np.float64]
    arms: NDArray[np.float64]
    turns: NDArray[np.float64]

    @property
    def pair(self) -> NDArray[np.intp]:
        """The pair of each, (n,)."""
        return self.way // 2

    @property
    def slopes(self) -> NDArray[np.float64]:
        """Slopes of the errors by the motion of the scan, (3, n)."""
        return np.stack([*self.normals, cross(self.arms, self.normals)])

    @property
    def along(self) -> NDArray[np.float64]:
        """Slopes that errors would have at walls at right angles, (3, n)."""
        return np.stack([-self.normals[1], self.normals[0], dot(self.arms, self.normals)])


class BeamsOfPairs:
    """Beams of P pairs of scans, made ready to be laid on the walls of the pair's other one, pose by pose.

    ``counts`` (P,) are their numbers, both scans' together.
    """

    def __init__(self, pairs: Sequence[tuple[WallLines, WallLines]]) -> None:
        walls = [walls for pair in pairs for walls in pair]
        beams = [beams for one, other in pairs for beams in (other, one)]
        counts = np.array([len(one.ends) for one in walls], np.intp)
        first = np.cumsum(counts) - counts
        self._numbers = np.stack([w.numbers + (w.numbers >= 0) * n for w, n in zip(walls, first, strict=True)])
        self._centres = np.concatenate([one.centres for one in walls]).T
        self._normals = np.concatenate([one.normals for one in walls]).T
        self._reaches = np.concatenate([one.reaches for one in walls])
        self._turns = np.concatenate([one.turns for one in walls])
        self._ends = np.concatenate([one.ends for one in beams]).T
        self._facing = np.concatenate([one.normals for one in beams]).T
        self._way = np.repeat(np.arange(len(beams)), [len(one.ends) for one in beams])
        self.counts = counts.reshape(-1, 2).sum(axis=1)

    def met(self, motions: NDArray[np.float64]) -> BeamsAtWalls:
        """The beams at walls, where the second scan of each pair is at a pose (P, 3) in the first one's frame."""
        poses = np.stack([motions, motions_between(motions, np.zeros(3))], axis=1).reshape(-1, 3).T
        cos, sin = np.cos(poses[2])[self._way], np.sin(poses[2])[self._way]
        arms = turned(self._ends, cos, sin)
        ends = arms + poses[:2, self._way]
        degrees = np.round(np.degrees(np.arctan2(ends[1], ends[0]))).astype(np.intp)
        walls = self._numbers[self._way, degrees]  # negative ones count from the end, as degrees do
        away = ends - self._centres[:, walls]  # of the last wall where there is none
        normals = self._normals[:, walls]
        beyond = np.abs(cross(normals, away)) - self._reaches[walls]
        facing = np.abs(dot(normals, turned(self._facing, cos, sin)))
        same = np.flatnonzero((walls >= 0) & (beyond < OFF_WALL) & (facing > FACING))
        normals = normals[:, same]
        errors = dot(normals, away[:, same])
        return BeamsAtWalls(self._way[same], errors, normals, arms[:, same], self._turns[walls[same]])


def slopes_of_ways(motions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slopes of the poses of both ways by the motions (P, 3), (2 P, 3, 3): those of the way back by the way there."""
    cos, sin, none = np.cos(motions[:, 2]), np.sin(motions[:, 2]), np.zeros(len(motions))
    back = motions_between(motions, np.zeros(3))
    of_back = np.array([[-cos, -sin, back[:, 1]], [sin, -cos, -back[:, 0]], [none, none, none - 1]])
    of_there = np.broadcast_to(np.eye(3), (len(motions), 3, 3))
    return np.stack([of_there, np.moveaxis(of_back, -1, 0)], axis=1).reshape(-1, 3, 3)


def turned(points: NDArray[np.float64], cos: NDArray[np.float64], sin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (2, n), each turned about the origin."""
    return np.stack([cos * points[0] - sin * points[1], sin * points[0] + cos * points[1]])


def dot(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inner products of vectors (2, n)."""
    return np.asarray(one[0] * other[0] + one[1] * other[1])


def cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outer products of vectors (2, n)."""
    return np.asarray(one[0] * other[1] - one[1] * other[0])
