"""The task to find out where one is, after being carried somewhere else."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.task import Episode, Situation, Task, TaskGround

LED = 3.0
"""The robot is led so far along the route before it is carried off [m]: a choice, some four views."""
ON_PATH = 0.5
"""Share of episodes in which it is set down on the path, looking along it; else off it, looking anywhere; a choice."""
ASIDE, OFF, TURNED = 0.2, 0.6, math.radians(10)
"""So far beside the path it is set down on it, and off it, and so far turned on it [m, m, rad]; choices."""
HERE = 1.3
"""A place so near to where the robot is is the right one [m]: a choice, one and a half times the places' distance."""
SURE = 0.9
"""The belief is right and sure when it gives the right places this probability; a choice."""


def belief_in(belief: Belief, places: NDArray[np.float64], pose: Pose) -> float:
    """Probability that a belief gives to places (K, 2) [m] within ``HERE`` of where the robot truly is."""
    here = np.hypot(*(places - (pose.x, pose.y)).T) <= HERE
    return float((1.0 - belief.lost) * belief.places[here].sum())


class FoundAgain(Episode):
    """Reward: by how much more the localiser believes in where the robot truly is than at the last step.

    The belief is the probability of the places within ``HERE`` of the truth, times that of being on the path at all.
    The goal is reached when it is ``SURE``; what remains is the belief that is missing to 1.
    """

    def __init__(self, ground: TaskGround, start: Pose, led: tuple[float, float]) -> None:
        assert ground.places is not None, "tasks with a map are given its places"
        self.start, self.led = start, led
        self._places = ground.places

    def remaining(self, situation: Situation) -> float:
        """Probability that the belief lacks."""
        assert situation.belief is not None, "tasks with a map are told the belief"
        return 1.0 - belief_in(situation.belief, self._places, situation.pose)

    def reached(self, situation: Situation) -> bool:
        """True if the belief is right and sure."""
        return self._remaining <= 1.0 - SURE


class RecoverTask(Task):
    """Find out where one is: after a short drive along the path the robot is carried to some other place.

    Its localiser still believes in the old one.
    """

    behaviours = ("MN:1000", "MT:90", "MT:-90", "MT:30", "MT:-30", "MW:left,0.8", "MW:right,0.8", "stop")
    mapped = turns = True
    route = "round"

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Draw where the robot is led, and where it is set down then."""
        begin = float(rng.uniform(0.0, max(ground.way.length - LED, 0.0)))
        along = float(rng.uniform(0.0, max(ground.path.length - LED, 0.0)))
        on_path = rng.random() < ON_PATH
        side, turn = (ASIDE, TURNED) if on_path else (OFF, math.pi)
        aside, turned = rng.uniform((-side, -turn), (side, turn))
        return FoundAgain(ground, ground.path.pose(along, aside, turned), (begin, begin + LED))
