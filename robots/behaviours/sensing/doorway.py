"""A doorway held in the odometer's frame while the robot moves, and how wide the way through it is.

Who finds doorways in one scan is handed in: any function that names their centre, width and heading.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.planar import PlanarPose, out_of, wrapped
from refseq_bench.robots.signals import LaserScan

LOOKS = 5
"""Scans that are looked at before a doorway is chosen (1 s); it has to be found in more than half of them: choices."""
KEPT = 8
"""Findings that a doorway's place is the median of: a choice. Older ones are off by the odometer's drift."""
SAME, ALIKE = 0.3, math.radians(25)
"""Findings whose centres are nearer [m] and whose headings are closer [rad] are of one doorway: choices."""
SURE = 3
"""A doorway is elsewhere when so many findings in turn say so: a choice, a single one may err."""
STEP = 0.12
"""Neighbouring points of one thing are no farther apart [m]: a choice, twice what beams leave at 3 m, aslant."""
FACE = (-0.1, 0.3)
"""Depths before and behind the wall's face [m] between which the leaf of a door has its hinge: a choice."""
PROUD = 0.04
"""Points nearer to a jamb [m] are the jamb: a choice, a few times a beam's error."""
STRAYS = 2
"""So many points are nothing: a beam that meets two things at once ends between them."""


class Doorway(Protocol):
    """An opening in a wall, or a recess of it, in the scanner's frame.

    ``centre`` and ``width`` [m] between the jambs, ``heading`` [rad] in which one goes straight through and away.
    """

    @property
    def centre(self) -> tuple[float, float]: ...  # noqa: D102

    @property
    def width(self) -> float: ...  # noqa: D102

    @property
    def heading(self) -> float: ...  # noqa: D102


DoorFinder = Callable[[LaserScan], Sequence[Doorway]]
"""Finds doorways in a scan; closed ones, too, by their recess."""


@dataclass(frozen=True, slots=True)
class Passage:
    """A doorway in the odometer's frame, ``width`` [m] wide; its ``axis`` begins at the middle of the wall's face."""

    axis: DirectedLine
    width: float

    def same(self, other: "Passage") -> bool:
        """True if two findings are of one doorway."""
        return self.away(other) < SAME and self.alike(other)

    def away(self, other: "Passage") -> float:
        """Distance of two findings [m]."""
        return math.hypot(self.axis.x - other.axis.x, self.axis.y - other.axis.y)

    def alike(self, other: "Passage") -> bool:
        """True if two findings have about the same heading."""
        return abs(wrapped(self.axis.heading - other.axis.heading)) < ALIKE


@dataclass(frozen=True, slots=True)
class ClearWay:
    """The widest way through a doorway: ``middle`` [m] to the left of its axis, and ``width`` [m].

    ``leaf`` tells that all that narrows it hangs on a jamb, as a door's leaf does.
    """

    middle: float
    width: float
    leaf: bool


class DoorWatch:
    """Looks for doorways, then holds on to one; the scanner is ``laser`` [m] ahead of the axle."""

    def __init__(self, finder: DoorFinder, laser: float) -> None:
        self._finder, self._laser = finder, laser
        self._looks: deque[list[Passage]] = deque(maxlen=LOOKS)
        self._mine: deque[Passage] = deque(maxlen=KEPT)
        self._off: deque[float] = deque(maxlen=SURE)

    def look(self, pose: PlanarPose, scan: LaserScan) -> None:
        """Look at a scan that was taken at ``pose``."""
        found = [self._placed(pose, door) for door in self._finder(scan)]
        self._looks.append(found)
        if self._mine:
            held = self.passage
            self._mine.extend([door for door in found if held.same(door)][:1])
            # Two doorways side by side are farther apart than one is wide.
            away = [held.away(door) for door in found if held.alike(door) and held.away(door) < held.width]
            self._off.extend(sorted(away)[:1])

    def choose(self, pose: PlanarPose, heading: float, within: float) -> bool:
        """Hold on to the nearest doorway whose heading is ``within`` [rad] of ``heading``, if there is one."""
        doors = [door for found in self._looks for door in found if self._often(door)]
        doors = [door for door in doors if abs(wrapped(door.axis.heading - heading)) <= within]
        if doors:
            nearest = min(doors, key=lambda door: math.hypot(door.axis.x - pose.x, door.axis.y - pose.y))
            self._mine.extend(door for door in doors if nearest.same(door))
        return bool(doors)

    @property
    def passage(self) -> Passage:
        """The doorway that is held on to: the median of its newest findings."""
        first = self._mine[0].axis.heading
        turns = [wrapped(door.axis.heading - first) for door in self._mine]
        places = [(door.axis.x, door.axis.y, door.width) for door in self._mine]
        x, y, width = np.median(places, axis=0).tolist()
        return Passage(DirectedLine(x, y, first + float(np.median(turns))), width)

    @property
    def off(self) -> float:
        """Least distance of the doorway's newest findings from where it is held to be [m]."""
        return min(self._off) if len(self._off) == SURE else 0.0

    def _often(self, door: Passage) -> bool:
        return 2 * sum(any(map(door.same, found)) for found in self._looks) > LOOKS

    def _placed(self, pose: PlanarPose, door: Doorway) -> Passage:
        x, y = door.centre
        ((x, y),) = out_of(pose, np.array([[x + self._laser, y]])).tolist()
        return Passage(DirectedLine(x, y, pose.heading + door.heading), door.width)


def clearance_of(door: Passage, points: NDArray[np.float64], before: float, beyond: float) -> ClearWay:
    """Find the widest straight way between ``points`` (n, 2), from ``before`` a door's face to ``beyond`` it [m]."""
    place, half = door.axis.seen(points), door.width / 2
    place = place[(np.abs(place[:, 1]) < half) & (place[:, 0] > -before) & (place[:, 0] < beyond)]
    edges = np.concatenate([[-half], np.sort(place[:, 1]), [half]])
    widest = int(np.argmax(np.diff(edges)))
    right, left = edges[widest : widest + 2].tolist()
    return ClearWay((left + right) / 2, left - right, _all_hang_on_a_jamb(place, half))


def _all_hang_on_a_jamb(place: NDArray[np.float64], half: float) -> bool:
    """True if points (n, 2) in a doorway of ``half`` the width can be reached from a jamb in small steps."""
    jamb = (half - np.abs(place[:, 1]) < PROUD + STEP) & (place[:, 0] > FACE[0]) & (place[:, 0] < FACE[1])
    reached, rest = place[jamb], place[~jamb]
    while len(reached) and len(rest) > STRAYS:
        near = np.hypot(*(rest[:, None] - reached[None]).transpose(2, 0, 1)).min(axis=1) < STEP
        reached, rest = rest[near], rest[~near]
    return len(rest) <= STRAYS
