"""Stop: stand still."""

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, Senses, finished, waiting
from refseq_bench.robots.behaviours.guarded import Guarded


class Halt(Guarded):
    """Brake, until the robot stands."""

    def _move(self, senses: Senses) -> BehaviourStep:
        if senses.state.stands:
            return finished("stands")
        twist = senses.state.twist
        return waiting(f"still goes at {twist.linear:.2f} m/s, {twist.angular:.2f} rad/s")
