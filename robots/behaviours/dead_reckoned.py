"""A motion in open loop, as LAMP's ``MOVE``: one speed, one turn rate, until something ends it."""

from robots.behaviours.behaviour import BehaviourStep, Frame, Senses, finished
from robots.behaviours.guarded import PATIENCE, Guarded
from robots.behaviours.until import Until
from robots.motion import Twist


class DeadReckoned(Guarded):
    """Move as ``twist`` says ``until`` something ends it, and look at nothing else: only the robot's stops hold it."""

    def __init__(self, frame: Frame, twist: Twist, until: Until, *, patience: float = PATIENCE) -> None:
        super().__init__(frame, patience)
        self._twist, self._until = twist, until

    def _move(self, senses: Senses) -> BehaviourStep:
        if why := self._until.reached(senses):
            return finished(why)
        return BehaviourStep(self._until.eased(self._twist, self.frame.limits))
