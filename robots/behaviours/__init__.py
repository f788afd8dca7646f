"""Behaviours that any robot runs: inputs are what it senses, the output is a ``Twist`` (card X1, appendix C)."""

from refseq_bench.robots.behaviours.behaviour import (
    Behaviour,
    BehaviourOutcome,
    BehaviourStep,
    Ranger,
    RobotDescription,
    Senses,
    failed,
    finished,
    waiting,
)
from refseq_bench.robots.behaviours.guarded import Guarded

__all__ = [
    "Behaviour",
    "BehaviourOutcome",
    "BehaviourStep",
    "Guarded",
    "Ranger",
    "RobotDescription",
    "Senses",
    "failed",
    "finished",
    "waiting",
]
