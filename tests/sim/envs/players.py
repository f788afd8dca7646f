"""Agents for the environments: some that know what to do, and one that does not."""

import math
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

from refseq.planar import Pose
from refseq_bench.sim.bench.polyline import Polyline
from refseq_bench.sim.envs.robot_env import RobotEnv

Policy = Callable[[Any, dict[str, Any]], str]
"""From an observation and the info to a behaviour as it is written."""
CLOSE = 1.6
"""Nearer than this ahead a corridor ends [m]."""
LOOKAHEAD = 1.2


class Turner:
    """What these policies share: a turn that was begun is finished."""

    def __init__(self) -> None:
        self.turn = ""

    def __call__(self, observation: Any, info: dict[str, Any]) -> str:
        if not self.turn or info["outcome"] != "running" or info["action"] != self.turn:
            self.turn = self.wanted(observation, info)
        return self.turn or "MN:1000"

    def wanted(self, observation: Any, info: dict[str, Any]) -> str:
        """The turn to begin now, if any."""
        raise NotImplementedError


class Corridor(Turner):
    """Carry on, and where it ends turn to where there is more room."""

    def wanted(self, observation: Any, info: dict[str, Any]) -> str:
        scan = observation["scan"]
        if scan[170:191].min() > CLOSE:
            return ""
        right, left = (np.sort(side)[-60:].mean() for side in (scan[:180], scan[181:]))
        return "MT:90" if left > right else "MT:-90"


class AlongPath(Turner):
    """Carry on along the path of a map, by the truth."""

    def __init__(self, env: RobotEnv) -> None:
        super().__init__()
        assert env.places is not None
        self._way = Polyline(env.places[:, :2])

    def wanted(self, observation: Any, info: dict[str, Any]) -> str:
        x, y, heading = info["pose"]
        along, _ = self._way.project(Pose(x, y, heading))
        ahead = self._way.pose(min(along + LOOKAHEAD, self._way.length))
        off = math.degrees(math.remainder(math.atan2(ahead.y - y, ahead.x - x) - heading, 2 * math.pi))
        size = 90 if abs(off) > 60 else 30 if abs(off) > 20 else 0
        return f"MT:{math.copysign(size, off):.0f}" if size else ""


def through_the_door(observation: Any, info: dict[str, Any]) -> str:
    """Cross the door ahead."""
    return "MC:ahead"


def at_random(env: gym.Env[Any, Any], seed: int) -> Policy:
    """Any behaviour at any time."""
    rng, words = np.random.default_rng(seed), written(env)
    return lambda observation, info: str(rng.choice(words))


def written(env: gym.Env[Any, Any]) -> list[str]:
    """The behaviours that its actions are."""
    unwrapped = env.unwrapped
    assert isinstance(unwrapped, RobotEnv)
    return list(unwrapped.behaviours)


def play(env: gym.Env[Any, Any], policy: Policy, seed: int) -> list[tuple[float, bool, bool, dict[str, Any]]]:
    """Reward, whether it ended or was cut off, and info of each step of an episode."""
    words, steps = written(env), []
    observation, info = env.reset(seed=seed)
    over = False
    while not over:
        observation, reward, ended, truncated, info = env.step(words.index(policy(observation, info)))
        steps.append((float(reward), ended, truncated, info))
        over = ended or truncated
    return steps
