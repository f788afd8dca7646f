"""Headings of a trajectory against its own path: ahead, straight back, or as no robot on wheels drives.

A robot goes where it heads, or straight back. Over pieces of the way, each step is turned by its heading, so that its
sum lies along the robot: noise of small steps cancels, and arcs go ahead throughout. Turned the other way round, it has
one direction where headings count the other way than the path turns.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from refseq.logs.trajectory import Trajectory
from refseq.planar import wrapped

PIECE = 0.5
"""Pieces of the way are so long, as the crow flies [m]: over less, noise has directions of its own."""
LEAST = 3.0
"""Way below which nothing is told [m]."""
COARSE, JUMP = math.radians(30.0), 3.0
"""A step in which the heading turns by more [rad], or that is longer [m], tells no direction."""
ASIDE = math.radians(45.0)
"""The way goes aside where it is so far off the heading, and off straight back [rad]."""
MOST = 0.5
"""Share of the way that has to go aside before that is told: robots that drive sideways do so now and then."""
STEADY = 0.05
"""Share of the way that a rule may leave aside, by squared sines. Raw logs of fr079, ACES and MIT CSAIL leave 0.1 % by
their headings as they are, and 25 % and more by mirrored ones."""
BETTER = 4.0
"""A rule has to leave so many times less aside than headings as they are."""
TOLD = 0.5
"""Way that headings have to leave aside before another rule is looked for [m]: a quarter circle of 0.6 m does."""
STRAIGHT_BACK, BACKED = 0.9, 5.0
"""A robot drives back all the time if it does over this share of its way, and the way is so long [m]."""
SAME = math.radians(2.0)
"""Headings within so little are one [rad]."""


class HeadingFault(Enum):
    """Ways in which headings contradict a path."""

    TURNED = auto()
    """By one angle throughout."""
    BACKWARD = auto()
    """Straight back, nearly all of the way."""
    MIRRORED = auto()
    """They turn to the left where the path turns to the right."""
    CONSTANT = auto()
    """They stay the same while the path turns."""
    ASIDE = auto()
    """Most of the way goes aside, by no rule."""


@dataclass(frozen=True, slots=True)
class HeadingDoubt:
    """A ``fault`` of headings over ``way`` [m], of which the ``share`` goes as the fault tells.

    ``angle`` [rad] is how far the way lies to the left of headings that are turned. Of mirrored ones it is the sum of
    heading and direction of the way, by half turns: 0 of a mirrored axis, a quarter turn where x and y are swapped.
    """

    fault: HeadingFault
    way: float
    share: float
    angle: float = 0.0


def heading_doubt(trajectory: Trajectory) -> HeadingDoubt | None:
    """Doubt about the headings of a trajectory; None where they go along its path, or too little of it tells."""
    ahead, mirrored, headings = _pieces(trajectory.poses)
    ways = np.abs(ahead)
    way = float(ways.sum())
    if way < LEAST:
        return None
    asides = np.angle(ahead)
    kept = _left_aside(ahead, 0.0)
    turned, other = _axis(ahead), _axis(mirrored)
    by_turn, by_mirror = _left_aside(ahead, turned), _left_aside(mirrored, other)
    if kept >= TOLD and by_mirror <= STEADY * way and BETTER * by_mirror < min(kept, by_turn):
        return HeadingDoubt(HeadingFault.MIRRORED, way, 1 - by_mirror / way, other)
    if abs(turned) > ASIDE and by_turn <= STEADY * way:
        to_left = float((ways * np.cos(asides - turned)).sum()) > 0
        angle = turned if to_left else turned - math.copysign(math.pi, turned)
        return HeadingDoubt(HeadingFault.TURNED, way, 1 - by_turn / way, angle)
    if np.ptp(headings) < SAME and kept > STEADY * way:
        return HeadingDoubt(HeadingFault.CONSTANT, way, kept / way)
    back = _share(ways, np.cos(asides) < -math.cos(ASIDE))
    if back >= STRAIGHT_BACK and way >= BACKED:
        return HeadingDoubt(HeadingFault.BACKWARD, way, back)
    aside = _share(ways, np.abs(np.sin(asides)) > math.sin(ASIDE))
    return HeadingDoubt(HeadingFault.ASIDE, way, aside) if aside > MOST else None


def _share(ways: NDArray[np.float64], which: NDArray[np.bool_]) -> float:
    return float(ways[which].sum() / ways.sum())


def _axis(motions: NDArray[np.complex128]) -> float:
    """The direction [rad] along which motions go, one way or the other, within a quarter turn either way."""
    return float(np.angle((motions**2 / np.maximum(np.abs(motions), 1e-9)).sum()) / 2)


def _left_aside(motions: NDArray[np.complex128], axis: float) -> float:
    """Way that motions leave aside of an axis [rad], by squared sines [m]."""
    return float((np.abs(motions) * np.sin(np.angle(motions) - axis) ** 2).sum())


def _pieces(
    poses: NDArray[np.float64],
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]:
    """Motion over each piece of the way, turned back by its headings and, to mirror them, forth, and the mean heading.

    Motions are complex, ahead is real [m].
    """
    ends = _ends(poses)
    if len(ends) < 2:
        return np.zeros(0, complex), np.zeros(0, complex), np.zeros(0)
    steps = np.diff(poses[: ends[-1] + 1, :2], axis=0) @ np.array([1, 1j])
    turns = wrapped(np.diff(poses[: ends[-1] + 1, 2]))
    headings = poses[0, 2] + np.cumsum(turns) - turns / 2  # in the middle of each step
    ahead, mirrored = (np.add.reduceat(steps * np.exp(sign * headings), ends[:-1]) for sign in (-1j, 1j))
    coarse = np.logical_or.reduceat((np.abs(turns) > COARSE) | (np.abs(steps) > JUMP), ends[:-1])
    means = np.add.reduceat(headings, ends[:-1]) / np.diff(ends)
    return ahead[~coarse], mirrored[~coarse], means[~coarse]


def _ends(poses: NDArray[np.float64]) -> NDArray[np.intp]:
    """Indices of the poses between which pieces lie: each at least ``PIECE`` from the one before."""
    found, (x, y) = [0], poses[0, :2].tolist() if len(poses) else (0.0, 0.0)
    for index, (east, north) in enumerate(poses[:, :2].tolist()):
        if math.hypot(east - x, north - y) >= PIECE:
            found.append(index)
            x, y = east, north
    return np.array(found)
