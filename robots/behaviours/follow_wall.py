"""MW: move along a wall at a distance, on its left or right."""

import math

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished, waiting
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.moves import driven, turned
from refseq_bench.robots.behaviours.phases import ARRIVED, Travelled
from refseq_bench.robots.behaviours.sensing.lanes import choose_lane, lanes
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.room import MARGIN, SIDE_MARGIN
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.behaviours.sensing.wall import DetectedWall, SearchWindow, WallSide, find_wall
from refseq_bench.robots.behaviours.steering import turn_rate_onto
from refseq_bench.robots.planar import PlanarPose

BACK, FORTH = -1.0, 5.0
"""A wall is looked for from so far behind the axle to so far ahead of it [m]: a choice.

A gap that is shorter than the view ahead is passed: the wall beyond it is seen before this side of it ends."""
SHORTEST = 0.6
"""So much of a wall has to be seen [m]: a choice, less than there is between two doors."""
FIRST_REACH = 2.5
"""A wall is not farther away than this at the start [m]: a choice."""
RECESS, BEND = 0.4, math.radians(15)
"""By so much [m, rad] a wall may shift or bend from one scan to the next: a choice."""
FRONT_REACH, FRONT_SHORTEST, FRONT_TILT = 4.0, 1.0, math.radians(30)
"""A wall across the way is looked for so far ahead [m], is at least so long [m] and slants by no more: choices.

Nobody who stands there is so wide."""
FRONT_GAP = 0.5
"""It has no wider gap: what else lies on one line by chance is no wall [m]; a choice, less than any robot is wide."""
MOST_ASIDE = 1.5
"""The farthest that it leaves its way for things that stand at the wall [m]: a choice."""
CORNER_SIGHT = 3.5
"""Where a wall is across the way, it makes room for its tail from so far on [m]: a choice."""
CORNER_DONE = math.radians(15)
"""With no more than this left of a corner it follows the next wall: a choice."""


def closest(robot: RobotDescription) -> float:
    """The least distance [m] from a wall to the middle of the axle at which a robot can follow it."""
    return robot.shape.half_width + 0.1


class FollowWall(Guarded):
    """Follow the wall on a ``side``, the middle of the axle ``distance`` [m] away from it.

    With a ``length`` [m] it has finished when it has driven so far; it turns on the spot in inside corners, and so
    turns back in a dead end: there it leaves the wall as far as its tail needs. Without one it has finished where the
    wall ends, or before a wall across the way. Gaps up to about 4 m are passed; so is what stands at the wall, with as
    little room as a lane has. It fails when there is no wall.
    """

    def __init__(
        self,
        robot: RobotDescription,
        side: WallSide,
        distance: float,
        length: float | None = None,
        *,
        patience: float = PATIENCE,
    ) -> None:
        super().__init__(robot, patience)
        self._side, self._distance, self._length = side, distance, length
        self._around, self._travelled = Surroundings(robot), Travelled()
        self._wall: DetectedWall | None = None
        self._front: DetectedWall | None = None
        self._into: DetectedWall | None = None  # the wall that it turns to, while it is in a corner

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._around.lost:
            return waiting(self._around.lost)
        pose, travelled = senses.pose, self._travelled.so_far(senses)
        if self._length is not None and self._length - travelled < ARRIVED:
            return finished(f"followed the wall for {travelled:.2f} m")
        if self._into is not None:
            return self._round_corner(self._into, pose)
        if self._around.fresh:
            self._find(pose)
        if self._wall is None:
            return waiting(f"no wall on the {self._side.name.lower()} within {FIRST_REACH} m")
        return self._along(self._wall, pose, travelled)

    def _find(self, pose: PlanarPose) -> None:
        """Find the wall anew, and what is across the way."""
        points, side = self._around.all, self._side.value
        if self._wall is None:
            line, across, tilt = DirectedLine.through(pose), _sorted(0.1 * side, FIRST_REACH * side), 2 * BEND
        else:
            line = self._wall.line.at(self._wall.line.pose(pose).x, 0.0)
            across, tilt = (-RECESS, RECESS), BEND
        found = find_wall(points, line, SearchWindow((BACK, FORTH), across, tilt), SHORTEST)
        self._wall = found or self._wall
        if self._wall is not None:
            ahead = DirectedLine(pose.x, pose.y, self._wall.line.heading - side * math.pi / 2)
            window = SearchWindow((-FIRST_REACH, FIRST_REACH), _sorted(0.0, FRONT_REACH * side), FRONT_TILT)
            front = find_wall(points, ahead, window, FRONT_SHORTEST)
            self._front = front if front is not None and self._bars(front, pose) else None

    def _bars(self, front: DetectedWall, pose: PlanarPose) -> bool:
        """True if a wall ahead goes across all of the robot's way, and on to the side that it would turn to."""
        along, half = front.line.pose(pose).x, self.robot.shape.half_width
        return front.start < along - half / 2 and front.end > along + half and front.gap < FRONT_GAP

    def _along(self, wall: DetectedWall, pose: PlanarPose, travelled: float) -> BehaviourStep:
        """Follow the wall that is beside it."""
        left = wall.end - wall.line.pose(pose).x
        if left < ARRIVED:
            return finished(f"the wall ended after {travelled:.2f} m")
        if self._length is not None:
            left = min(left, self._length - travelled)
        if self._front is None:
            return self._in_lane(wall, pose, left, 0.0)
        clear, room = abs(self._front.line.pose(pose).y), self._room_at_corner()
        if self._length is None and clear - room < ARRIVED:
            return finished(f"a wall across the way {clear:.2f} m ahead, after {travelled:.2f} m")
        if clear - room < ARRIVED:
            self._into = self._front
        makes_room = self._length is not None and clear < CORNER_SIGHT
        return self._in_lane(wall, pose, min(left, clear - room), room - self._distance if makes_room else 0.0)

    def _in_lane(self, wall: DetectedWall, pose: PlanarPose, left: float, away: float) -> BehaviourStep:
        """Drive on in the lane at the distance, or ``away`` [m] from it, or where there is room."""
        side = self._side.value
        way = wall.line.at(0.0, -side * self._distance)
        error, seen = way.pose(pose), way.seen(self._around.all)
        wide = lanes(-side * away, *_sorted(0.0, -side * MOST_ASIDE))
        offset = choose_lane(seen, error.x, self.robot.shape, wide)
        return driven(self.robot, self._around.points(pose), turn_rate_onto(error, offset), left)

    def _round_corner(self, into: DetectedWall, pose: PlanarPose) -> BehaviourStep:
        """Turn on the spot, until the wall ahead is the one beside it."""
        left = -into.line.pose(pose).heading
        if abs(left) < CORNER_DONE:
            self._wall, self._into, self._front = into, None, None
        return turned(self.robot, self._around.points(pose), left)

    def _room_at_corner(self) -> float:
        """Distance of the axle from both walls of a corner when the robot turns there [m]."""
        shape = self.robot.shape
        return max(self._distance, shape.swing + 2 * SIDE_MARGIN, shape.ahead + MARGIN + SIDE_MARGIN)


def _sorted(one: float, other: float) -> tuple[float, float]:
    return min(one, other), max(one, other)
