"""MA: go to a set point by the odometer, on a straight line."""

import math

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import ARRIVED, Phase, Straight, Turning
from refseq_bench.robots.behaviours.sensing.line import DirectedLine
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.planar import PlanarPose, wrapped

ASIDE = math.radians(20)
"""A point that is farther than this from where the robot looks is turned to first: a choice."""


class SetPoint(Guarded):
    """Go to (``x``, ``y``) [m] as seen from where the robot starts; turn there to ``heading`` [rad] if one is given.

    It turns to the point, follows the straight line to it, and slows down towards its end. It does not leave the line:
    what stands on it is waited for, and after a while the behaviour has failed.
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
        return finished(self._where(self._start.pose(senses.pose)))

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

    def _where(self, reached: PlanarPose) -> str:
        off = math.hypot(self._x - reached.x, self._y - reached.y)
        return f"at ({reached.x:.2f}, {reached.y:.2f}) m, {off:.3f} m from the set point by the odometer"
