"""The wall beside a robot: the line that most of what the laser has met lies on (Hough), then least squares."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.surroundings import CELL, thinned

TILT = math.radians(40)
"""A wall is no steeper than this against the line along which it is looked for: a choice."""
TILT_STEP = math.radians(2)
BIN = 0.05
"""Width of the strip in which points vote for one wall [m]: a choice, three times the laser's noise and steps."""
THICKNESS = 0.05
"""Points this near to the line belong to the wall in the end [m]: a choice; skirtings and flat things on it do."""


class WallSide(Enum):
    """On which side of the robot a wall is; +1 is to the left."""

    LEFT = 1
    RIGHT = -1


@dataclass(frozen=True, slots=True)
class DetectedWall:
    """A wall as a ``line``, on which points were met from ``start`` to ``end`` [m], with no gap wider than ``gap``."""

    line: DirectedLine
    start: float
    end: float
    gap: float


@dataclass(frozen=True, slots=True)
class SearchWindow:
    """Where to look for a wall, seen from a line: along it and across of it [m], each from least to most."""

    along: tuple[float, float]
    across: tuple[float, float]
    tilt: float = TILT


def find_wall(
    points: NDArray[np.float64], line: DirectedLine, window: SearchWindow, shortest: float
) -> DetectedWall | None:
    """The wall with the most points (n, 2) in a window; None where none is ``shortest`` [m] long.

    Points are thinned to one in a square of ``CELL`` first, so that votes are lengths and not densities of beams.
    """
    seen = _within(thinned(line.seen(points)), window)
    need = shortest / CELL * 0.8  # a slanting line meets fewer squares than its length has
    if len(seen) < max(need, 3):
        return None
    tilt, across = _strongest(seen, window.tilt)
    for _ in range(2):
        on_it = np.abs(_residuals(seen, tilt, across)) < THICKNESS
        if np.count_nonzero(on_it) < max(need, 3):
            return None
        tilt, across = _fitted(seen[on_it])
    if abs(tilt) > window.tilt + TILT_STEP:
        return None
    found = line.at(0.0, across / math.cos(tilt), tilt)
    along = np.sort(found.seen(line.points(seen[on_it]))[:, 0])
    wall = DetectedWall(found, float(along[0]), float(along[-1]), float(np.diff(along).max()))
    return wall if wall.end - wall.start > shortest else None


def _within(seen: NDArray[np.float64], window: SearchWindow) -> NDArray[np.float64]:
    (first, last), (low, high) = window.along, window.across
    x, y = seen.T
    return seen[(x > first) & (x < last) & (y > low) & (y < high)]


def _strongest(seen: NDArray[np.float64], most: float) -> tuple[float, float]:
    """Tilt [rad] and distance [m] of the strip with the most points."""
    tilts = np.arange(-most, most + TILT_STEP / 2, TILT_STEP)
    across = seen[None, :, 1] * np.cos(tilts)[:, None] - seen[None, :, 0] * np.sin(tilts)[:, None]  # (tilts, points)
    strip = np.floor((across - across.min()) / BIN).astype(np.int64)
    wide = int(strip.max()) + 2
    votes = np.bincount((strip + wide * np.arange(len(tilts))[:, None]).ravel(), minlength=wide * len(tilts))
    # Two strips side by side: a wall on the border of two is not torn apart.
    pairs = votes.reshape(len(tilts), wide)
    pairs = pairs[:, :-1] + pairs[:, 1:]
    best = int(np.argmax(pairs))
    return float(tilts[best // (wide - 1)]), float(across.min() + BIN * (best % (wide - 1) + 1))


def _residuals(seen: NDArray[np.float64], tilt: float, across: float) -> NDArray[np.float64]:
    return seen[:, 1] * math.cos(tilt) - seen[:, 0] * math.sin(tilt) - across


def _fitted(seen: NDArray[np.float64]) -> tuple[float, float]:
    """Total least squares: tilt and distance of the line with the least squares of distances."""
    x, y = seen.mean(axis=0)
    dx, dy = seen[:, 0] - x, seen[:, 1] - y
    tilt = 0.5 * math.atan2(2 * float(dx @ dy), float(dx @ dx - dy @ dy))
    return tilt, y * math.cos(tilt) - x * math.sin(tilt)
