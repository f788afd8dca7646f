"""The mission's executor as a policy: it hears what the robot's localiser believes, and chooses the actions."""

import math
from typing import Any

from refseq.belief import Belief
from refseq.missions.behaviour_codes import length_of
from refseq.missions.executor import Do, Executor
from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.sim.envs.robot_env import RobotEnv
from refseq_bench.sim.envs.tasks.run_mission import STOP
from refseq_bench.sim.errors import SimError

HALF_STEP = 0.25
"""A behaviour of some length is over when less than this is left [m]: half of what the Robuter goes in a step."""


class ExecutorPolicy:
    """Plays an environment of missions: beliefs, the odometer and the ends of behaviours go in, actions come out.

    It needs no truth, and is made anew after each ``reset``. A step is longer than the executor's control period, so
    that it stops only within half of one. Raises ``SimError`` for an environment without a mission, or with twists.
    """

    def __init__(self, env: RobotEnv) -> None:
        if env.plan is None or not env.chooses_behaviours:
            raise SimError("the executor needs a mission and behaviours as actions; valid is refseq/Mission-v0")
        self.executor = Executor(env.plan)
        self._env = env
        self._believed: Belief | None = None
        self._travelled, self._until = 0.0, math.inf
        self._doing: Do | None = None

    def __call__(self, _observation: Any, info: dict[str, Any]) -> int:
        """The action after an observation, whatever form a wrapper has given it, and its info."""
        self._hear(info)
        do = self.executor.do
        if self._doing is None or do.number != self._doing.number:
            self._until = self._travelled + _length(do.behaviour)
        self._doing = do
        return self._env.number_of(STOP if do.halt else do.behaviour)

    def _hear(self, info: dict[str, Any]) -> None:
        """Tell the executor what has happened since the last action."""
        executor, (ahead, left, _) = self.executor, self._env.motion
        self._travelled += math.hypot(ahead, left)
        executor.move(float(info["time"]), self._travelled)
        if self._env.belief is not None and self._env.belief is not self._believed:
            self._believed = self._env.belief
            executor.believe(self._believed)
        if self._doing is None or self._doing.halt or executor.do.number != self._doing.number:
            return
        outcome = BehaviourOutcome(info["outcome"])
        if outcome is BehaviourOutcome.FAILED:
            executor.ended(False, info["why"])
        elif outcome is BehaviourOutcome.FINISHED or self._travelled > self._until - HALF_STEP:
            executor.ended(True, info["why"] or f"went on for {self._travelled - self._until:+.2f} m of it")


def _length(behaviour: str) -> float:
    """The way of a behaviour that travels [m]; infinite of others."""
    return length_of(behaviour) or math.inf
