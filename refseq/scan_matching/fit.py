"""Where one scan was taken as seen from another: coarse to fine, with its uncertainty.

At first beams are counted that meet the other's walls, on a grid of poses. From the best on, least squares move ends of
beams onto straight pieces of wall, in both directions, and far ones weigh less and less (Y. Chen and G. Medioni,
"Object modelling by registration of multiple range images", 1992; weights of S. Geman and D. McClure). What no wall
tells stays where it is assumed to be: along a bare corridor the covariance is that of the assumption.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.pose_graph import motions_between
from refseq.scan_matching.lines import ROUNDED, WallLines
from refseq.scan_matching.walls import ScanWalls

REACH, TURN = 0.7, np.radians(25.0)
"""The other scan is sought up to so far along and aside [m], and turned so far [rad]."""
GRID = np.stack(
    np.meshgrid(*[np.linspace(-far, far, n) for far, n in ((REACH, 7), (REACH, 7), (TURN, 9))], indexing="ij"),
    axis=-1,
).reshape(-1, 3)
BEAMS = 6
"""Every so many-th beam is looked at on the grid."""
STAYS = 0.01, 0.02
"""Share of the beams that a metre of shift and a radian of turn have to bring: in bare corridors all are alike."""
ASSUMED = np.array([0.5, 0.5, np.radians(15.0)])
"""Standard deviations of where the other scan is taken to be before the walls tell [m, m, rad]."""
SCALES = (0.3, 0.2, 0.1, 0.1, 0.05, 0.05, 0.05)
"""Distances from a wall at which an end of a beam has a quarter of its weight [m], step by step."""
INDEPENDENT = 0.2
"""Share of the beams whose errors are taken as independent: what is off is off for many. More makes poses surer."""
BEYOND = 0.25
"""A pose may come to lie so far beyond where it was sought [m, and share of the turn]."""
OFF_WALL, FACING = 0.3, 0.9
"""An end of a beam is not of a piece of wall that ends so far from it [m], or whose normals have a smaller product."""
CLOSE = 0.03
"""Ends of beams so near to a wall [m] are of it, where scores are counted. More forgives more."""
FEWEST = 20
"""Fewer beams tell nothing."""


class LaidScan:
    """A scan by degrees, ``ranges`` (360,) [m], made ready to be laid on others."""

    def __init__(self, ranges: NDArray[np.float64]) -> None:
        self._ranges = ranges

    @cached_property
    def walls(self) -> ScanWalls:
        """Its walls, to be met."""
        return ScanWalls(self._ranges)

    @cached_property
    def lines(self) -> WallLines:
        """Straight pieces of them."""
        return WallLines(self._ranges)


def laid_scan(kept: NDArray[np.uint16] | None) -> LaidScan | None:
    """A scan as maps keep it, (360,) [cm]; None where there is none, or too few of its beams end on straight walls."""
    scan = None if kept is None else LaidScan(kept / 100.0)
    return scan if scan is not None and len(scan.lines.ends) >= FEWEST else None


@dataclass(frozen=True, slots=True)
class ScanFit:
    """Where another scan was taken as seen from one: ``motion`` (3,), ahead and to the left [m], turned [rad].

    ``covariance`` (3, 3) is of the same. ``share`` is that of the beams that meet walls for both scans, of those whose
    ends both could see. ``score`` is that times the share of beams on straight walls that end at one of the other scan
    within ``CLOSE``: a place that only looks like it leaves more of them off.
    """

    motion: NDArray[np.float64]
    covariance: NDArray[np.float64]
    share: float
    score: float


def fitted(one: LaidScan, other: LaidScan) -> ScanFit | None:
    """Lay a scan on another; None where too few beams meet, or only beyond where it is sought."""
    worth = shares(one, other, GRID, BEAMS) - np.hypot(*GRID[:, :2].T) * STAYS[0] - np.abs(GRID[:, 2]) * STAYS[1]
    return _refined(one, other, GRID[worth.argmax()])


def shares(one: LaidScan, other: LaidScan, motions: NDArray[np.float64], every: int = 1) -> NDArray[np.float64]:
    """Share of the beams that meet walls for both, for each pose (m, 3) of the other scan in the one's."""
    met, through = one.walls.met(other.walls.points[::every], motions)
    back = other.walls.met(one.walls.points[::every], motions_between(motions, np.zeros(3)))
    met, through = met + back[0], through + back[1]
    return np.asarray(met / np.maximum(met + through, 1))


def _refined(one: LaidScan, other: LaidScan, start: NDArray[np.float64]) -> ScanFit | None:
    """Least squares from a pose on: Gauss and Newton, with weights that grow sharper."""
    motion, assumed = start, np.diag(ASSUMED**-2)
    for scale in SCALES:
        met = _met(one.lines, other.lines, motion)
        if len(met.errors) < FEWEST:
            return None
        weights = 1 / np.square(1 + np.square(met.errors / scale))
        variance = ROUNDED**2 + weights @ np.square(met.errors) / weights.sum()
        weights *= INDEPENDENT / variance
        weighed = met.slopes * weights[:, None]
        known = weighed.T @ met.slopes
        motion = motion - np.linalg.solve(known + assumed, weighed.T @ met.errors + assumed @ motion)
    if np.abs(motion[:2]).max() > REACH + BEYOND or abs(motion[2]) > TURN * (1 + BEYOND):
        return None
    # Of a wall whose direction is uncertain some of what it seems to tell along itself is chance.
    by_chance = (met.along * (weights * met.turns)[:, None]).T @ met.along
    covariance = np.asarray(np.linalg.inv(_without_negative(known - by_chance) + assumed), np.float64)
    share, met = float(shares(one, other, motion[None])[0]), _met(one.lines, other.lines, motion)
    close = np.count_nonzero(np.abs(met.errors) < CLOSE) / (len(one.lines.ends) + len(other.lines.ends))
    return ScanFit(motion, covariance, share, share * close)


def _without_negative(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same with nothing below 0 in any direction; headings are weighed as at one metre."""
    values, axes = np.linalg.eigh(information)
    return np.asarray((axes * np.maximum(values, 0.0)) @ axes.T)


class _Met(NamedTuple):
    """Ends of beams at the walls of another scan, n of them.

    ``errors`` (n,) are their distances from the walls [m], ``slopes`` (n, 3) those of the errors by the motion, and
    ``along`` (n, 3) what the slopes would be of walls at right angles; ``turns`` (n,) the variance of a wall's
    direction [rad²].
    """

    errors: NDArray[np.float64]
    slopes: NDArray[np.float64]
    along: NDArray[np.float64]
    turns: NDArray[np.float64]


def _met(one: WallLines, other: WallLines, motion: NDArray[np.float64]) -> _Met:
    """Ends of beams of each scan at walls of the other, which is at some pose in the one's frame."""
    cos, sin = np.cos(motion[2]), np.sin(motion[2])
    back = motions_between(motion, np.zeros(3))
    # Slopes of the way back by the way there.
    of_back = np.array([[-cos, -sin, back[1]], [sin, -cos, -back[0]], [0.0, 0.0, -1.0]])
    there, here = _one_way(one, other, motion), _one_way(other, one, back)
    here = here._replace(slopes=here.slopes @ of_back, along=here.along @ of_back)
    return _Met(*(np.concatenate(pair) for pair in zip(there, here, strict=True)))


def _one_way(walls: WallLines, seen: WallLines, motion: NDArray[np.float64]) -> _Met:
    """Ends of beams of a scan that was ``seen`` at some pose, at the walls in their direction; slopes by the pose."""
    cos, sin = np.cos(motion[2]), np.sin(motion[2])
    turned = np.array([[cos, sin], [-sin, cos]])  # from the right
    arms = seen.ends @ turned
    ends = arms + motion[:2]
    degrees = np.round(np.degrees(np.arctan2(ends[:, 1], ends[:, 0]))).astype(np.intp) % len(walls.numbers)
    which = walls.numbers[degrees]
    there = np.flatnonzero(which >= 0)
    which, arms = which[there], arms[there]
    normals, away = walls.normals[which], ends[there] - walls.centres[which]
    beyond = np.abs(_cross(normals, away)) - walls.reaches[which]
    facing = np.abs((normals * (seen.normals[there] @ turned)).sum(axis=1))
    same = (beyond < OFF_WALL) & (facing > FACING)
    normals, arms = normals[same], arms[same]
    along = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    slopes, beside = (np.column_stack([axis, _cross(arms, axis)]) for axis in (normals, along))
    return _Met((normals * away[same]).sum(axis=1), slopes, beside, walls.turns[which[same]])


def _cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
