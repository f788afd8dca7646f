"""MN: carry on the way it goes, clear of what stands there."""

import math

from refseq_bench.robots.behaviours.behaviour import (
    BehaviourStep,
    RobotDescription,
    Senses,
    failed,
    finished,
    waiting,
)
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.moves import driven
from refseq_bench.robots.behaviours.phases import ARRIVED, Travelled
from refseq_bench.robots.behaviours.sensing.lanes import lane_past
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.behaviours.sensing.wall import DetectedWall, SearchWindow, find_wall
from refseq_bench.robots.behaviours.steering import turn_rate_onto
from refseq_bench.robots.planar import PlanarPose, wrapped

BACK, FORTH = -1.0, 5.0
"""Walls are looked for from so far behind the axle to so far ahead of it [m]: a choice."""
ASIDE = (0.2, 2.5)
"""Walls of a corridor are between so far and so far from its line [m]: a choice."""
SHORTEST = 1.5
"""So much of a corridor's wall has to be seen [m]: a choice, more than a cupboard has."""
TILT = math.radians(20)
"""A wall that is steeper against the way is none of a corridor [rad]: a choice."""
ABOUT = 0.5
"""Walls that it keeps to are looked for so far about where they ought to be [m]: a choice, what a turn may be off."""
WIDE, ASLANT = 0.2, math.radians(3)
"""Two walls are those of its corridor where they are as far apart as those were, and parallel, but for so much
[m, rad]: choices. Then it knows them wherever it stands between them."""
LONG, BESIDE = 3.0, math.radians(10)
"""Where none of its walls is there yet, any leads it straight that is so long and no steeper to its way [m, rad]:
choices."""
ROOM = 0.5
"""Its way is done where it has waited in vain so far before its end [m]: a choice, what a goal may be off."""


Sides = tuple[DetectedWall | None, DetectedWall | None]
"""The walls to the left and the right; None: none there."""


class CarryOn(Guarded):
    """Go on for ``length`` [m] along the way it looks: in the middle of a corridor, along a wall, or straight on.

    Where it is told how far the walls to the ``left`` and ``right`` are [m], 0: none, it keeps to these alone, as far
    as they are there; where they are not, it goes on as a long wall beside it leads, and straight on without any. Its
    way may be another than where it looks: ``aside`` [m] to the left of it, and turned to the left by ``turn`` [rad].
    It passes what stands in the way where there is room; else it waits, and fails in the end, or is done where no more
    than half a metre is left of a longer way.
    """

    def __init__(
        self,
        robot: RobotDescription,
        length: float,
        left: float | None = None,
        right: float = 0.0,
        aside: float = 0.0,
        turn: float = 0.0,
        *,
        patience: float = PATIENCE,
    ) -> None:
        super().__init__(robot, patience)
        self._length = length
        self._walls = None if left is None else (left, -right)
        self._aside, self._turn = aside, turn
        self._around, self._travelled = Surroundings(robot), Travelled()
        self._way: DirectedLine | None = None
        self._gone = 0.0

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._around.lost:
            return waiting(self._around.lost)
        pose = senses.pose
        self._gone = travelled = self._travelled.so_far(senses)
        if self._length - travelled < ARRIVED:
            return finished(f"went on for {travelled:.2f} m")
        way = self._way or DirectedLine.through(pose).at(0.0, self._aside, self._turn)
        self._way = way = self._found(way, pose) if self._around.fresh else way
        error, seen = way.pose(pose), way.seen(self._around.all)
        left = self._length - travelled
        offset = lane_past(seen, error.x, self.robot.shape, left)
        return driven(self.robot, self._around.points(pose), turn_rate_onto(error, offset), left)

    def _given_up(self, why: str) -> BehaviourStep:
        left = self._length - self._gone
        # It was led by places that lie half a metre apart and more: a wall ahead may be where its way was to end.
        if left > min(ROOM, self._gone):
            return failed(why)
        return finished(f"went on for {self._gone:.2f} m, {left:.2f} m less than told: {why}")

    def _found(self, way: DirectedLine, pose: PlanarPose) -> DirectedLine:
        """The way on: the line so far, or as the walls beside it lead."""
        here = way.at(way.pose(pose).x, 0.0)
        if self._walls is not None:
            return self._beside_walls(here, self._walls)
        left, right = self._sides(here)
        if left is not None and right is not None:
            return _middle(left.line, right.line)
        wall = left or right
        return here if wall is None else DirectedLine(here.x, here.y, wall.line.heading)

    def _beside_walls(self, here: DirectedLine, walls: tuple[float, float]) -> DirectedLine:
        """The line as far from its walls as it was told, with the heading of those that are there."""
        if not any(walls):
            return here
        sides = self._sides(here)
        if all(walls) and (corridor := _between(here, sides, walls)) is not None:
            return corridor
        lines = []
        for across in walls:
            wall = self._wall(here, (across - ABOUT, across + ABOUT)) if across else None
            beside = None if wall is None else wall.line.pose(here)
            # One that slants may come near ahead, and be another wall: that of the hall before the corridor.
            if wall is not None and beside is not None and abs(beside.y + across) < ABOUT:
                lines.append(wall.line.at(beside.x, -across))
        return _middle(lines[0], lines[-1]) if lines else _along(here, sides)

    def _sides(self, line: DirectedLine) -> Sides:
        """The walls to the left and the right of a line, as far off as those of a corridor."""
        near, far = ASIDE
        return self._wall(line, (near, far)), self._wall(line, (-far, -near))

    def _wall(self, line: DirectedLine, across: tuple[float, float]) -> DetectedWall | None:
        return find_wall(self._around.all, line, SearchWindow((BACK, FORTH), across, TILT), SHORTEST)


def _along(here: DirectedLine, sides: Sides) -> DirectedLine:
    """The line with the heading of the longest wall beside it: in a hall as in the corridor behind it."""
    long = [wall for wall in sides if wall is not None and wall.end - wall.start > LONG]
    headings = [(wall.end - wall.start, wrapped(wall.line.heading - here.heading)) for wall in long]
    turn = max((one for one in headings if abs(one[1]) < BESIDE), default=(0.0, 0.0))[1]
    return DirectedLine(here.x, here.y, here.heading + turn)


def _between(here: DirectedLine, sides: Sides, walls: tuple[float, float]) -> DirectedLine | None:
    """The line between two walls that can only be those it was told of; None where there are none."""
    left, right = sides
    if left is None or right is None or abs(wrapped(left.line.heading - right.line.heading)) > ASLANT:
        return None
    found = [wall.line.at(wall.line.pose(here).x, 0.0) for wall in (left, right)]
    across = found[1].pose(found[0]).y
    if abs(across - (walls[0] - walls[1])) > WIDE:
        return None
    return _middle(*(line.at(0.0, -told) for line, told in zip(found, walls, strict=True)))


def _middle(left: DirectedLine, right: DirectedLine) -> DirectedLine:
    turn = wrapped(right.heading - left.heading)
    return DirectedLine((left.x + right.x) / 2, (left.y + right.y) / 2, left.heading + turn / 2)
