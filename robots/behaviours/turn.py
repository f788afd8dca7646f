"""MT: turn about itself, or on an arc. The thesis names 90°, 180° and 270°; any angle up to a full turn is as good."""

import math

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import Arc, Phase, Turning
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings


class Turn(Guarded):
    """Turn by ``angle`` [rad], counter-clockwise where it is positive, by the odometer.

    Without a ``radius`` [m] it turns on the spot; with one it drives on an arc, where a robot with a long tail needs
    less room. It waits, and fails in the end, where there is no room as far as it can tell (``Turning``, ``Arc``).
    """

    def __init__(
        self, robot: RobotDescription, angle: float, radius: float = 0.0, *, patience: float = PATIENCE
    ) -> None:
        super().__init__(robot, patience)
        self._angle, self._radius = angle, radius
        self._around = Surroundings(robot)
        self._start = 0.0
        self._turning: Phase | None = None

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        if self._turning is None:
            self._start = senses.pose.heading
            target = self._start + self._angle
            self._turning = Arc(self.robot, target, self._radius) if self._radius else Turning(self.robot, target)
        step = self._turning.step(senses, self._around)
        if step is not None:
            return step
        turned = senses.pose.heading - self._start
        return finished(f"turned by {math.degrees(turned):.1f}° of {math.degrees(self._angle):.0f}° by the odometer")
