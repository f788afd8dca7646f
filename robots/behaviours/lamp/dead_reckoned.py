"""A motion in open loop, as LAMP's ``MOVE``: one speed, one turn rate, until something ends it."""

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, Senses, finished
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.lamp.until import Until
from refseq_bench.robots.motion import Twist


class DeadReckoned(Guarded):
    """Move as ``twist`` says ``until`` something ends it, and look at nothing else: only the robot's stops hold it."""

    def __init__(self, robot: RobotDescription, twist: Twist, until: Until, *, patience: float = PATIENCE) -> None:
        super().__init__(robot, patience)
        self._twist, self._until = twist, until

    def _move(self, senses: Senses) -> BehaviourStep:
        if why := self._until.reached(senses):
            return finished(why)
        return BehaviourStep(self._until.eased(self._twist, self.robot.limits))
