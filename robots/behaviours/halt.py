"""Stop: stand still."""

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, Senses, finished, waiting
from refseq_bench.robots.behaviours.guarded import Guarded

STANDS = 0.02
"""A robot that is slower stands [m/s, rad/s]: a choice, a balancing one is never quite still."""


class Halt(Guarded):
    """Brake, until the robot stands."""

    def _move(self, senses: Senses) -> BehaviourStep:
        twist = senses.state.twist
        if abs(twist.linear) < STANDS and abs(twist.angular) < STANDS:
            return finished("stands")
        return waiting(f"still goes at {twist.linear:.2f} m/s, {twist.angular:.2f} rad/s")
