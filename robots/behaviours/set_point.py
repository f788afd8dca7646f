"""MA: go to a set point by the odometer, on a straight line."""

import math

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, failed, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import ARRIVED, Phase, Straight, Turning
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.planar import PlanarPose, wrapped

ASIDE = math.radians(20)
"""A point that is farther than this from where the robot looks is turned to first: a choice."""
OFF = 0.3
"""A set point is reached from no farther away than this [m]: a choice, less than it takes to stand beside a thing."""


class SetPoint(Guarded):
    """Go to (``x``, ``y``) [m] as seen from where the robot starts; turn there to ``heading`` [rad] if one is given.

    It turns to the point, follows the straight line to it, and slows down towards its end. It passes what stands on the
    line where there is room, and comes back to it; else it waits, and after a while has failed. So has one that ends
    beside its point, because that is taken.
    """

    def __init__(
        self, robot: RobotDescription, x: float, y: float, heading: float | None = None, *, patience: float = PATIENCE
    ) -> None:
        super().__init__(robot, patience)
        self._x, self._y, self._heading = x, y, heading
        self._around = Surroundings(robot)
        self._start: DirectedLine | None = None
        self._phases: list[Phase] = []

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._start is None:
            self._start = DirectedLine.through(senses.pose)
            self._phases = self._planned(self._start, senses.pose)
        while self._phases:
            step = self._phases[0].step(senses, self._around)
            if step is not None:
                return step
            del self._phases[0]
        reached = self._start.pose(senses.pose)
        off = math.hypot(self._x - reached.x, self._y - reached.y)
        told = f"at ({reached.x:.2f}, {reached.y:.2f}) m, {off:.3f} m from the set point by the odometer"
        return finished(told) if off <= OFF else failed(told)

    def _planned(self, start: DirectedLine, pose: PlanarPose) -> list[Phase]:
        phases: list[Phase] = []
        length, bearing = math.hypot(self._x, self._y), math.atan2(self._y, self._x)
        looks = 0.0
        if length > ARRIVED:
            if abs(bearing) > ASIDE:
                phases.append(Turning(self.robot, pose.heading + bearing))
            phases.append(Straight(self.robot, start.at(0.0, 0.0, bearing), length))
            looks = bearing
        if self._heading is not None:
            # The short way round.
            turn = wrapped(self._heading - looks)
            phases.append(Turning(self.robot, pose.heading + looks + turn))
        return phases
