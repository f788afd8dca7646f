"""Go beside what the sonars of one side hear, by sonar and odometry only (LAMP's ``MOVP``)."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.lamp.until import Until
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.room import SIDE_MARGIN
from refseq_bench.robots.behaviours.sensing.sonar_filter import abeam
from refseq_bench.robots.behaviours.sensing.sonar_ring import cone_middles
from refseq_bench.robots.behaviours.sensing.wall import WallSide
from refseq_bench.robots.behaviours.steering import turn_rate_onto
from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose, out_of

REACH = 1.5
"""Echoes of a sonar of the side from farther away are not beside the robot [m]: a choice."""
REMEMBERED = 1.0
"""Echoes of so much of the way count [m]: a choice, enough that the line through it is true to a degree."""
FEW, SHORT = 40, 0.2
"""Fewer echoes than this, or the halves of them nearer together [m], make no line: choices."""
STEEPEST = 0.2
"""An error to the side counts as no more than this [m], which makes it head for its line at 11° at most: a choice."""
CURVATURE = 0.5
"""It steers no tighter arc than this [1/m], since its tail swings out the other way: a choice."""


def keeps(robot: RobotDescription) -> float:
    """Distance of the middle of the axle from what it goes beside [m]: there it could turn on the spot.

    A line of the program after it may say so, and a robot with a tail would meet the wall.
    """
    return robot.shape.swing + 2 * SIDE_MARGIN


class Beside(Guarded):
    """Go at ``speed`` [m/s] beside what is on a ``side``, ``until`` something ends it.

    Where that side hears nothing near it goes straight on, as it does without a side.
    """

    def __init__(
        self, robot: RobotDescription, speed: float, side: WallSide | None, until: Until, *, patience: float = PATIENCE
    ) -> None:
        super().__init__(robot, patience)
        self._speed, self._side, self._until = speed, side, until
        self._echoes = _SideEchoes(robot, side) if side else None
        self._way: DirectedLine | None = None

    def _move(self, senses: Senses) -> BehaviourStep:
        if why := self._until.reached(senses):
            return finished(why)
        if self._way is None:
            self._way = DirectedLine.through(senses.pose)
        if self._side is not None and self._echoes is not None:
            found = self._echoes.line(senses, self._way)
            if found is not None:
                self._way = found.at(0.0, -self._side.value * keeps(self.robot))
        error = self._way.pose(senses.pose)
        slight = PlanarPose(error.x, min(max(error.y, -STEEPEST), STEEPEST), error.heading)
        most = CURVATURE * self._speed
        return BehaviourStep(Twist(self._speed, min(max(turn_rate_onto(slight), -most), most)))


class _SideEchoes:
    """Where in the odometer's frame the sonars of a side have heard something on the last stretch of the way."""

    def __init__(self, robot: RobotDescription, side: WallSide) -> None:
        self._count, self._numbers = len(robot.sonars), abeam(robot, side.value)
        self._rangers = tuple(robot.sonars[number] for number in self._numbers)
        self._heard: deque[tuple[float, NDArray[np.float64]]] = deque()
        self._newest = -math.inf

    def line(self, senses: Senses, along: DirectedLine) -> DirectedLine | None:
        """The line through what was heard, of which ``along`` tells the direction; None where that is too little."""
        state = senses.state
        if state.time > self._newest and state.sonar is not None and len(state.sonar) == self._count:
            self._newest = state.time
            echoes = cone_middles(self._rangers, state.sonar[self._numbers], REACH)
            self._heard.append((state.distance, out_of(state.pose, echoes)))
        while self._heard and state.distance - self._heard[0][0] > REMEMBERED:
            self._heard.popleft()
        points = np.concatenate([np.empty((0, 2)), *(points for _, points in self._heard)])
        return _resistant(along, points) if len(points) >= FEW else None


def _resistant(along: DirectedLine, points: NDArray[np.float64]) -> DirectedLine | None:
    """Tukey's resistant line, with two groups: through the medians of the rear and of the front half of the points.

    Stray echoes move it little. It is level where one half is above the other as often as below.
    """
    x, y = along.seen(points).T
    rear = x <= np.median(x)
    if rear.all():
        return None
    (x0, y0), (x1, y1) = ((np.median(x[half]), np.median(y[half])) for half in (rear, ~rear))
    if x1 - x0 < SHORT:
        return None
    slope = (y1 - y0) / (x1 - x0)
    return along.at((x0 + x1) / 2, (y0 + y1) / 2, math.atan(slope))
