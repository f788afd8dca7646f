"""The task to drive along a corridor to its end."""

import math

import numpy as np

from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.task import Episode, Situation, Task, TaskGround

ARRIVED = 0.5
"""So near to the route's end it is reached [m]; a choice."""
BEGIN, ASIDE, TURNED = 1.0, 0.25, math.radians(15)
"""An episode begins within so much of the route's start, beside it, and turned from it [m, m, rad]; choices."""


class AlongCorridor(Episode):
    """Reward: the metres made good along the route since the last step; what is to the side of it counts nothing.

    The goal is reached where less than ``ARRIVED`` of the route is left.
    """

    def __init__(self, ground: TaskGround, start: Pose) -> None:
        self.start = start
        self._way = ground.way
        self._along: float | None = None

    def remaining(self, situation: Situation) -> float:
        """Length that is left of the route [m]."""
        self._along, _ = self._way.project(situation.pose, self._along)
        return self._way.length - self._along

    def reached(self, situation: Situation) -> bool:
        """True if the robot is at the end."""
        return self._remaining <= ARRIVED


class FollowCorridorTask(Task):
    """Drive along a corridor, round its bends, to its end."""

    behaviours = ("MN:1000", "MT:90", "MT:-90", "MW:left,0.8", "MW:right,0.8", "stop")

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Begin near the route's start, a little beside it and turned."""
        along, aside, turned = rng.uniform((0.0, -ASIDE, -TURNED), (BEGIN, ASIDE, TURNED))
        return AlongCorridor(ground, ground.way.pose(along, aside, turned))
