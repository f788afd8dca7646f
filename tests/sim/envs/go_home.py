"""A task as a user writes it: the one on the page docs/gymnasium.md, at the top of a module, where workers find it."""

import math

import numpy as np

from refseq.planar import Pose
from refseq_bench.sim.envs import Episode, Situation, Task, TaskGround


class Homewards(Episode):
    """Reward: the metres that the robot has come nearer to the route's start."""

    def __init__(self, ground: TaskGround, start: Pose) -> None:
        self.start, self._way = start, ground.way

    def remaining(self, situation: Situation) -> float:
        along, _ = self._way.project(situation.pose)
        return along

    def reached(self, situation: Situation) -> bool:
        return self.remaining(situation) < 0.5


class GoHome(Task):
    """Drive back to the route's start, from anywhere on it."""

    behaviours = ("MN:1000", "MT:90", "MT:-90", "stop")

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        along = rng.uniform(2.0, ground.way.length)
        return Homewards(ground, ground.way.pose(along, 0.0, math.pi))


class WithoutEpisodes(Task):
    behaviours = ("stop",)


class WithoutBehaviours(Task):
    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        raise NotImplementedError
