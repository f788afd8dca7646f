"""Crossing a door or narrow opening (MC; appendix C d): find the nearest doorway, stand before it, go through, stop.

The robot drives to a point on the door's axis where it can turn without touching the wall, turns to the door, looks
again, and goes straight through: it steers by the doorway while that is found, by the odometer after.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, failed, finished, waiting
from refseq_bench.robots.behaviours.guarded import Guarded
from refseq_bench.robots.behaviours.sensing.doorway import LOOKS, ClearWay, DoorFinder, DoorWatch, Passage, clearance_of
from refseq_bench.robots.behaviours.sensing.room import SIDE_MARGIN, blocks_turn
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.behaviours.steering import TURN_GAIN, speed_for
from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose, wrapped

STILL = 0.05
"""A scan tells where the doorway is only while the robot turns slower [rad/s]: a choice.

Nobody says how old a scan is (0.2 s at most): in that time so slow a turn moves a jamb 1.5 m off by 1.5 cm."""
FACING, HEADED = math.radians(2), math.radians(3)
"""The robot has turned to the door, or to where it goes, when it is off by less [rad]: choices."""
FRONTAL = math.radians(50)
"""A doorway that is seen from less aslant [rad] shows how wide it is open: a choice."""

CLOSED = 0.1
"""A door that is open by less than this [m] is told to be closed: a choice."""
FARTHEST = 2.5
"""The point before the door is no farther off it [m]: a choice, well beyond the tip of a leaf."""


class CrossingSide(Enum):
    """Direction through the door that is meant, against the robot's heading when it begins [rad]."""

    AHEAD = 0.0
    LEFT = math.pi / 2
    RIGHT = -math.pi / 2


SIDE_SPREAD = math.radians(50)
"""A doorway is on a side if its heading is off by less [rad]: a choice, above 45° so that each is on some side."""


@dataclass(frozen=True, slots=True)
class CrossingSettings:
    """Settings of door crossing, in [m] and [m/s]; all are choices.

    ``margin`` is to be free on each side: 5 cm, within which a robot's own watch may stop it, as the RMP's does, and
    1 cm, to which the doorway's place is known and the line is kept.
    ``approach`` and ``crossing`` are speeds. At 0.2 m/s a scan comes every 4 cm, and with ``lookahead`` and
    ``TURN_GAIN`` the line is reached critically damped, with a time constant of 1 s: there are 4 of them between the
    point before the door and the jambs. It waits for what is nearer than ``ahead`` of its front: 0.09 m pass in the
    0.3 s that scan and command may take at 0.3 m/s, another 0.09 m while it brakes at 0.5 m/s².
    ``room`` is left to the wall where it turns, ``around`` is free there if it can choose, as it comes there aslant;
    walls are at most ``wall`` thick, and its tail goes on ``past`` that.
    """

    margin: float = SIDE_MARGIN
    approach: float = 0.3
    crossing: float = 0.2
    lookahead: float = 0.4
    ahead: float = 0.3
    room: float = 0.4
    around: float = 0.2
    wall: float = 0.3
    past: float = 0.1


class CrossDoor(Guarded):
    """Go through the nearest doorway on a ``side``, of those that ``finder`` finds, and stop when the tail is out."""

    def __init__(
        self,
        robot: RobotDescription,
        finder: DoorFinder,
        side: CrossingSide = CrossingSide.AHEAD,
        settings: CrossingSettings | None = None,
        **patience: float,
    ) -> None:
        super().__init__(robot, **patience)
        self._side, self._settings = side, settings or CrossingSettings()
        shape = robot.shape
        self._watch, self._around = DoorWatch(finder, robot.laser.ahead), Surroundings(robot)
        self._looked = 0  # scans since the robot stands still to look
        self._phase: Callable[[Senses], BehaviourStep] = self._find
        self._middle = 0.0
        self._front = math.hypot(shape.ahead, shape.half_width)  # radius of what the front takes in a turn
        self._before = self._front + self._settings.room  # what a turn before a flat wall takes
        self._start = -self._before  # where on the door's axis the axle is when the robot turns to the door
        self._end_at = shape.behind + self._settings.wall + self._settings.past
        self._needed = 2 * (shape.half_width + self._settings.margin)

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._around.lost:
            return waiting(self._around.lost)
        if self._around.fresh and senses.scan is not None and abs(senses.state.twist.angular) < STILL:
            self._watch.look(senses.pose, senses.scan)
            self._looked += 1
        return self._phase(senses)

    # --- phases, in their order ---

    def _find(self, senses: Senses) -> BehaviourStep:
        if self._looked < LOOKS:
            return BehaviourStep()
        pose = senses.pose
        if not self._watch.choose(pose, pose.heading + self._side.value, SIDE_SPREAD):
            return waiting(f"no door {self._side.name.lower()}{self._seen_instead(senses)}")
        axis = self._door.axis
        if math.cos(math.atan2(axis.y - pose.y, axis.x - pose.x) - axis.heading) > math.cos(FRONTAL):
            refused = self._refusal(self._way())
            if refused is not None:
                return refused
        self._start = self._room_before(pose)
        return self._go_on(self._face_start)

    def _face_start(self, senses: Senses) -> BehaviourStep:
        away, bearing = self._to_start(senses.pose)
        if away < self._settings.past:
            return self._go_on(self._face_door)
        if abs(bearing) < HEADED:
            return self._go_on(self._go_to_start)
        return self._turn(bearing, senses)

    def _go_to_start(self, senses: Senses) -> BehaviourStep:
        away, bearing = self._to_start(senses.pose)
        if away < 0.02 or math.cos(bearing) < 0:
            return self._go_on(self._face_door)
        speed = speed_for(self.robot.limits, self._settings.approach, away)
        # Close to the point its bearing swings about, and says nothing any more.
        return self._ahead(Twist(speed, TURN_GAIN * bearing * min(1.0, away / 0.2)), away, senses)

    def _face_door(self, senses: Senses) -> BehaviourStep:
        off = self._door.axis.pose(senses.pose).heading
        if abs(off) < FACING and abs(senses.state.twist.angular) < STILL:
            self._looked = 0
            return self._go_on(self._judge)
        return self._turn(-off, senses)

    def _judge(self, senses: Senses) -> BehaviourStep:
        """Look again from before the door."""
        if self._looked < LOOKS:
            return BehaviourStep()
        way = self._way()
        refused = self._refusal(way)
        if refused is not None:
            return refused
        if way.width < self._needed:
            return waiting(f"something stands in the door: {way.width:.2f} m free of {self._door.width:.2f} m")
        self._middle = way.middle
        return self._go_on(self._cross)

    def _cross(self, senses: Senses) -> BehaviourStep:
        off = self._watch.off
        if off > self._settings.margin:
            return failed(f"the door is {off:.2f} m from where it was: the robot was pushed or has slipped")
        at = self._door.axis.pose(senses.pose)
        if at.x >= self._end_at:
            return self._go_on(self._halt)
        heading = math.atan2(self._middle - at.y, self._settings.lookahead)
        twist = Twist(self._settings.crossing, TURN_GAIN * (heading - at.heading))
        return self._ahead(twist, self._end_at - at.x, senses)

    def _halt(self, senses: Senses) -> BehaviourStep:
        if senses.state.stands:
            return finished(f"crossed a door {self._door.width:.2f} m wide")
        return BehaviourStep()

    # --- what phases share ---

    @property
    def _door(self) -> Passage:
        return self._watch.passage

    def _way(self) -> ClearWay:
        reach = self._end_at + self.robot.shape.ahead
        return clearance_of(self._door, self._around.all, self._before, reach)

    def _refusal(self, way: ClearWay) -> BehaviourStep | None:
        """The end, where a door will not let the robot through however long it waits."""
        width = self._door.width
        if width < self._needed:
            return failed(f"door {width:.2f} m wide: too narrow, {self._needed:.2f} m are needed")
        if way.width < self._needed and way.leaf:
            kind = "closed" if way.width < CLOSED else "half open"
            return failed(f"door {way.width:.2f} m open of {width:.2f} m: {kind}")
        return None

    def _room_before(self, pose: PlanarPose) -> float:
        """The place on the axis nearest to the door where the front can turn, no farther off than the robot is.

        A leaf that opens to this side takes the room up to its tip.
        """
        along, across = self._door.axis.seen(self._around.all).T
        nearest = -self._before
        places = np.arange(nearest, max(self._door.axis.pose(pose).x, -FARTHEST), -0.05)
        gaps = np.hypot(along - places[:, None], across).min(axis=1, initial=np.inf)
        free = gaps > self._front + self._settings.around
        return float(places[np.argmax(free)]) if free.any() else nearest

    def _to_start(self, pose: PlanarPose) -> tuple[float, float]:
        """Distance [m] and bearing [rad] of the point before the door."""
        at = self._door.axis.pose(pose)
        x, y = self._start - at.x, -at.y
        return math.hypot(x, y), wrapped(math.atan2(y, x) - at.heading)

    def _turn(self, angle: float, senses: Senses) -> BehaviourStep:
        met = blocks_turn(self._around.points(senses.pose), self.robot.shape, angle)
        if len(met):
            return waiting(f"no room to turn: something is {float(np.hypot(*met[0])):.2f} m off the axle")
        return BehaviourStep(Twist(0.0, TURN_GAIN * angle))

    def _ahead(self, twist: Twist, left: float, senses: Senses) -> BehaviourStep:
        """Go on, unless something is ahead within what is ``left`` of the way [m]."""
        free = self._free(senses)
        if free < min(left, self._settings.ahead):
            return waiting(f"something is {free:.2f} m ahead")
        return BehaviourStep(twist)

    def _free(self, senses: Senses) -> float:
        """Free length of the way before the front [m], as wide as the robot; a single point is a stray."""
        shape = self.robot.shape
        x, y = self._around.points(senses.pose).T
        near = np.sort(x[(np.abs(y) < shape.half_width) & (x > 0)])
        return float(near[1]) - shape.ahead if len(near) > 1 else math.inf

    def _seen_instead(self, senses: Senses) -> str:
        """Tell of something that hides a door, or is where one should be."""
        free = self._free(senses)
        return f"; something {free:.1f} m in front" if self._side is CrossingSide.AHEAD and math.isfinite(free) else ""

    def _go_on(self, phase: Callable[[Senses], BehaviourStep]) -> BehaviourStep:
        """Stop, and begin another phase with the next step."""
        self._phase = phase
        return BehaviourStep()
