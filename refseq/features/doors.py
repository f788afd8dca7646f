"""Open doors and other narrow passages of a scan, each with a probability, and their bits (B.2, Table B.2, Fig. B.3).

The thesis takes its rules from Xiang, Santos and Liu, "Locating and crossing doors and narrow passages for a mobile
robot" (2004): walls give corners, corners give passages, of two types. Its thresholds are not known here, so all
numbers are choices. What is sought is a run of beams that pass a wall's line and meet something behind it, between

* two ends of the wall: an opening *in a wall*; or
* an end of the wall and a surface that crosses its line, as a side wall does: an opening *at a corner*.

Where something in front hides how far the opening goes, nobody knows of one.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.features.scan_bits import ScanBits
from refseq.features.walls import ScanLines, WallSettings, count_bits, find_lines
from refseq.view import Scan

COUNTS = (1, 2)


@dataclass(frozen=True, slots=True)
class DoorSettings:
    """Shape of a door; lengths [m], angle [rad].

    An opening is as wide as a door from ``narrow`` to ``wide`` (a double door), and outside less probable by a bell of
    σ ``margin``. What lies within ``edge`` of a line is on it; lines shorter than ``wall`` are no walls. Beside an
    opening the wall goes on for at least ``jamb``, and all of it should be long against ``support``; or there is a side
    wall, whose first ``side`` is square to the opening but for a bell of σ ``tilt``. Beams that end within ``recess``
    behind the line are stopped, as by a closed door, unless that is on the side of a jamb, at most ``thickness`` deep.
    An opening is passable if a way of ``clearance`` is free up to ``depth`` before and behind it. The thesis gives
    ``probability``, above which a door is one.
    """

    narrow: float = 0.6
    wide: float = 1.8
    margin: float = 0.1
    edge: float = 0.06
    wall: float = 0.3
    jamb: float = 0.1
    support: float = 0.5
    side: float = 0.25
    tilt: float = math.radians(10)
    recess: float = 0.15
    thickness: float = 0.25
    clearance: float = 0.6
    depth: float = 0.4
    probability: float = 0.75


@dataclass(frozen=True, slots=True)
class DetectedDoor:
    """An opening, in the scanner's frame.

    ``centre`` and ``width`` [m]; ``heading`` [rad], in which one goes straight through and away; ``probability`` that
    it is one; ``passable`` where nothing stands in it.
    """

    centre: tuple[float, float]
    width: float
    heading: float
    probability: float
    passable: bool

    @property
    def distance(self) -> float:
        """From the scanner to the centre [m]."""
        return math.hypot(*self.centre)

    @property
    def bearing(self) -> float:
        """Direction in which the centre is seen [rad]."""
        return math.atan2(self.centre[1], self.centre[0])


class _OpeningSide(NamedTuple):
    """One side of an opening, outward from it.

    The opening ends at ``at`` along the wall's line, from its middle [m]; the wall goes on from there for ``wall`` [m],
    or not at all (0) at a corner, where the side wall is ``off`` [rad] from square.
    """

    at: float
    wall: float
    off: float


def find_doors(scan: Scan, settings: DoorSettings, walls: WallSettings | None = None) -> list[DetectedDoor]:
    """Doors more probable than ``settings.probability``, most probable first; ``walls`` rule how lines are found.

    Beams without return are left out: glass gives none, either. Two walls may tell of the same door: the more probable
    one is kept.
    """
    walls = walls or WallSettings()
    return doors_in(find_lines(scan, walls), scan, settings, walls)


def doors_in(lines: ScanLines, scan: Scan, settings: DoorSettings, walls: WallSettings) -> list[DetectedDoor]:
    """As ``find_doors``, where the scan's ``lines`` are known already."""
    lines = lines[lines.length >= settings.wall]
    points = scan.points[scan.returned]
    found = [
        door
        for start, end, centre, direction in zip(lines.start, lines.end, lines.centre, lines.direction, strict=True)
        for door in _doors_beside((start, end), centre, direction, points, settings, walls.gap)
    ]
    doors: list[DetectedDoor] = []
    for door in sorted(found, key=lambda door: -door.probability):
        if all(math.dist(door.centre, other.centre) > other.width / 2 for other in doors):
            doors.append(door)
    return doors


def _doors_beside(
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    centre: NDArray[np.float64],
    direction: NDArray[np.float64],
    points: NDArray[np.float64],
    settings: DoorSettings,
    gap: float,
) -> Iterator[DetectedDoor]:
    """Doors at an end of one wall, or in it: its end points, and a point and the direction of its line."""
    # The beams turn to the left, so that what is behind the wall is to the right of its direction.
    away = np.array([direction[1], -direction[0]])
    place = (points - centre) @ np.stack([direction, away], axis=1)
    first, last = ((end - centre) @ direction for end in ends)
    for before, after in _runs(place[:, 1] > settings.edge):
        if place[before, 0] > last + gap or place[after, 0] < first - gap:
            continue  # another wall's, in the same line
        left = _side(place[before::-1] * [-1, 1], place[before + 1] * [-1, 1], settings, gap)
        right = _side(place[after:], place[after - 1], settings, gap)
        if left is None or right is None or (shape := _shape(left, right, settings)) <= settings.probability:
            continue
        width = left.at + right.at
        from_left = place + np.array([left.at, 0.0])
        probability = shape * _open(from_left[before + 1 : after], width, settings)
        if probability > settings.probability:
            x, y = centre + (right.at - left.at) / 2 * direction
            passable = _free(from_left, width, settings) >= settings.clearance
            yield DetectedDoor((float(x), float(y)), width, math.atan2(away[1], away[0]), probability, passable)


def _runs(behind: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """The points before and after each run of points that are behind the line; not those at the ends of the scan."""
    edges = np.flatnonzero(np.diff(behind))
    if len(behind) and behind[0]:
        edges = edges[1:]
    for before, last in zip(edges[:-1:2].tolist(), edges[1::2].tolist(), strict=True):
        yield before, last + 1


def _side(
    chain: NDArray[np.float64], inner: NDArray[np.float64], settings: DoorSettings, gap: float
) -> _OpeningSide | None:
    """One side of an opening: ``chain`` (n, 2) are the points from the opening on, ``inner`` the last one behind it.

    None where that is not known: something in front hides where the opening ends.
    """
    steps = np.hypot(*np.diff(chain, axis=0).T)
    chain = chain[: int(np.argmax(np.append(steps, np.inf) > gap)) + 1]
    if len(chain) < 2 or (abs(chain[0, 1]) > settings.edge and math.dist(chain[0], inner) > gap):
        return None
    on = int(np.argmax(np.append(np.abs(chain[:, 1]) > settings.edge, True)))
    at = float(chain[0, 0])
    if on >= 2 and (wall := float(chain[on - 1, 0]) - at) >= settings.jamb:
        # The wall ends somewhere between the last beam that met it and the next.
        return _OpeningSide(at - float(chain[1, 0] - at) / 2, wall, 0.0)
    aside = chain[max(0, on - 1) :] - chain[max(0, on - 1)]
    x, y = aside[min(int(np.searchsorted(np.hypot(*aside.T), settings.side)), len(aside) - 1)]
    return _OpeningSide(at, 0.0, abs(math.atan2(x, -y)))


def _shape(left: _OpeningSide, right: _OpeningSide, settings: DoorSettings) -> float:
    """Probability that a gap of such a width with such sides is a door."""
    width = left.at + right.at
    outside = max(0.0, settings.narrow - width, width - settings.wide) / settings.margin
    squares = outside**2 + (left.off**2 + right.off**2) / settings.tilt**2
    return math.exp(-0.5 * squares) * (1 - math.exp(-(left.wall + right.wall) / settings.support))


def _open(between: NDArray[np.float64], width: float, settings: DoorSettings) -> float:
    """The probability that more than half of a gap is open, by the points between its ends, (n, 2).

    Each beam passes or is stopped; any share of passing ones is as probable as another beforehand, so that the share's
    posterior is a beta distribution. The side of a jamb says nothing.
    """
    from scipy.special import betainc  # slow to import: views are read and extractors listed without it

    along, behind = between.T
    jamb = (np.abs(along) < settings.edge) | (np.abs(along - width) < settings.edge)
    told = behind[~(jamb & (behind < settings.thickness))]
    passed = np.count_nonzero(told > settings.recess)
    return float(betainc(len(told) - passed + 1, passed + 1, 0.5))


def _free(place: NDArray[np.float64], width: float, settings: DoorSettings) -> float:
    """The widest way through a gap between the things that stand in it, or near before or behind it [m]."""
    along, behind = place.T
    inside = (along > settings.edge) & (along < width - settings.edge) & (np.abs(behind) < settings.depth)
    return float(np.diff(np.sort(along[inside]), prepend=0.0, append=width).max())


class DoorCounts(ScanBits):
    """Table B.2's six bits: at least 1, 2 doors at 4 m and more, at 2 to 4 m, and nearer than 2 m.

    The table prints "at least 2" twice for the nearest ones; the first is read as 1. Passable and blocked doors count
    alike.
    """

    key = "doors/laser"

    def __init__(self, settings: DoorSettings, walls: WallSettings) -> None:
        self.settings = settings
        self.walls = walls

    @property
    def size(self) -> int:
        """Always six."""
        return 3 * len(COUNTS)

    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that are set."""
        doors = find_doors(scan, self.settings, self.walls)
        return count_bits(np.array([door.distance for door in doors]), COUNTS)
