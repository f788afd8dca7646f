"""Go through the next narrow opening ahead, by sonar and odometry only (LAMP's ``CROSS``)."""

import math

import numpy as np

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, failed, finished, waiting
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import Travelled
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.sonar_filter import SonarFilter, abeam
from refseq_bench.robots.behaviours.steering import turn_rate_onto
from refseq_bench.robots.motion import Twist

SPEED = 0.1
"""[m/s]: a choice, slow enough that the sonars hear an opening's sides some times while they are beside it."""
SIDE_NEAR = 0.6
"""In an opening the sonars of both sides read less than this [m]: one of 1.74 m is the widest. A choice."""
FARTHEST = 4.0
"""It has to be in the opening after so much way [m], and out of it after as much again: a choice."""
CURVATURE = 0.5
"""It steers no tighter arc than this [1/m]: its tail is in the opening, too. A choice."""


class Narrow(Guarded):
    """Go straight on, centred between what is to the left and to the right where both are near, until it is behind."""

    def __init__(self, robot: RobotDescription, *, patience: float = PATIENCE) -> None:
        super().__init__(robot, patience)
        self._sides = [abeam(robot, side) for side in (1, -1)]
        sideways = np.concatenate(self._sides)
        self._tail = robot.shape.behind + min(robot.sonars[number].x for number in sideways)
        self._filter, self._travelled = SonarFilter(robot.sonars), Travelled()
        self._way: DirectedLine | None = None
        self._entered = self._left = math.inf  # path lengths at which it was in the opening, and its sonars were out

    def _move(self, senses: Senses) -> BehaviourStep:
        self._filter.look(senses)
        if self._way is None:
            self._way = DirectedLine.through(senses.pose)
        if not self._filter.steady:
            return waiting("the sonars have to read some times first")
        gone = self._travelled.so_far(senses)
        self._look_aside(senses, gone)
        if gone - self._left > self._tail:
            return finished(f"went in after {self._entered:.2f} m, and was out after {gone:.2f} m")
        if gone > FARTHEST and not self._entered < math.inf:
            return failed(f"no narrow opening on {gone:.2f} m: nowhere did both sides read less than {SIDE_NEAR:g} m")
        if gone - FARTHEST > self._entered:
            return failed(f"no end of the opening that it went into after {self._entered:.2f} m, on {FARTHEST:g} m")
        most = CURVATURE * SPEED
        return BehaviourStep(Twist(SPEED, min(max(turn_rate_onto(self._way.pose(senses.pose)), -most), most)))

    def _look_aside(self, senses: Senses, gone: float) -> None:
        """See whether it is in the opening, and where the middle is."""
        ranges = self._filter.ranges
        left, right = (float(ranges[numbers].min()) for numbers in self._sides)
        inside = max(left, right) < SIDE_NEAR
        if inside:
            self._entered, self._left = min(self._entered, gone), math.inf
            middle = DirectedLine.through(senses.pose).at(0.0, (left - right) / 2)
            self._way = DirectedLine(middle.x, middle.y, self._way.heading if self._way else middle.heading)
        elif self._entered < math.inf:
            self._left = min(self._left, gone)
