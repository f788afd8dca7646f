"""The task to go to a place of a reference sequence."""

import math

import numpy as np

from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.task import Episode, Situation, Task, TaskGround

NEAREST, FARTHEST = 4.0, 12.0
"""A goal is between so far along the path from the start [m]; choices."""
ASIDE, TURNED = 0.2, math.radians(10)
"""A start is so far beside the path and turned from it at the most [m, rad]; choices."""
ARRIVED = 0.8
"""So near to a place the robot is at it [m]: a choice, about the distance of two places."""


class ToPlace(Episode):
    """Reward: the metres by which the way to the place has become shorter since the last step.

    That way is what lies between along the path, and how far off the path the robot is. The goal is reached within
    ``ARRIVED``.
    """

    def __init__(self, ground: TaskGround, start: Pose, along: float, goal: int) -> None:
        self.start, self.goal = start, goal
        self._path = ground.path
        self._goal_along = float(self._path.along[goal])
        self._along = along

    def remaining(self, situation: Situation) -> float:
        """The way to the place [m]."""
        self._along, off = self._path.project(situation.pose, self._along)
        return abs(self._goal_along - self._along) + off

    def reached(self, situation: Situation) -> bool:
        """True if the robot is at the place."""
        return self._remaining <= ARRIVED


class ReachPlaceTask(Task):
    """Go to a place of a reference sequence; what the localiser believes is part of the observation."""

    behaviours = ("MN:1000", "MT:90", "MT:-90", "MT:30", "MT:-30", "MW:left,0.8", "MW:right,0.8", "stop")
    mapped = goes_to_place = True
    route = "round"

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Begin on the path, with the goal farther on: paths are driven one way only."""
        along = ground.path.along
        first = int(np.searchsorted(along, NEAREST))
        goal = int(rng.integers(min(first, len(along) - 1), len(along)))
        back, aside, turned = rng.uniform((NEAREST, -ASIDE, -TURNED), (FARTHEST, ASIDE, TURNED))
        start = max(0.0, float(along[goal]) - back)
        return ToPlace(ground, ground.path.pose(start, aside, turned), start, goal)
