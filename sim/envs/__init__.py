"""Gymnasium environments: ``gym.make("sim.envs:RefSeq/FollowCorridor-v0")``; see ``docs/gymnasium.md``.

Importing this package registers all ids. Each task has two, for behaviours and for twists.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import gymnasium as gym

from sim.envs.episodes.actions import ByBehaviour, ByTwist
from sim.envs.robot_env import RobotEnv
from sim.envs.worlds.rooms import FORMS

__all__ = ["IDS", "RobotEnv"]

NAMESPACE = "RefSeq"
CORRIDORS = [f"corridor:{seed}" for seed in range(16)]
"""The corridors that are driven along where nothing else is asked for; others are for trying out what was learnt."""
ROOMS = [f"rooms:{form}" for form in range(len(FORMS))]
PERIODS = {"behaviours": ByBehaviour.period, "twist": ByTwist.period}
SUFFIXES = {"behaviours": "", "twist": "Twist"}

TASKS: Mapping[str, tuple[float, Mapping[str, Any]]] = MappingProxyType(
    {
        "FollowCorridor": (400.0, {"task": "follow-corridor", "world": CORRIDORS}),
        "CrossDoor": (60.0, {"task": "cross-door", "world": ROOMS}),
        "ReachPlace": (120.0, {"task": "reach-place", "world": "laboratory", "route": "round"}),
        "Recover": (120.0, {"task": "recover", "world": "laboratory", "route": "round"}),
    }
)
"""The time limit of each task [s], if all actions last as long as they may, and what makes it; choices."""


def _register() -> tuple[str, ...]:
    ids = []
    for name, (seconds, made_with) in TASKS.items():
        for actions, suffix in SUFFIXES.items():
            ids.append(f"{NAMESPACE}/{name}{suffix}-v0")
            gym.register(
                ids[-1],
                entry_point="sim.envs.robot_env:RobotEnv",
                vector_entry_point="sim.envs.batch:BatchEnv",
                max_episode_steps=round(seconds / PERIODS[actions]),
                kwargs={**made_with, "actions": actions},
            )
    return tuple(ids)


IDS = _register()
"""All ids that this package registers."""
