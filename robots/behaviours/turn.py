"""MT: turn about itself. The thesis names 90°, 180° and 270°; any angle up to a full turn either way is as good."""

import math

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import Turning
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings


class Turn(Guarded):
    """Turn on the spot by ``angle`` [rad], counter-clockwise where it is positive, by the odometer.

    It waits, and fails in the end, where there is no room as far as it can tell (``Turning``).
    """

    def __init__(self, robot: RobotDescription, angle: float, *, patience: float = PATIENCE) -> None:
        super().__init__(robot, patience)
        self._angle = angle
        self._around = Surroundings(robot)
        self._start = 0.0
        self._turning: Turning | None = None

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._turning is None:
            self._start = senses.pose.heading
            self._turning = Turning(self.robot, self._start + self._angle)
        step = self._turning.step(senses, self._around)
        if step is not None:
            return step
        turned = senses.pose.heading - self._start
        return finished(f"turned by {math.degrees(turned):.1f}° of {math.degrees(self._angle):.0f}° by the odometer")
