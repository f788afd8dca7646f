"""Registration of the environments' ids with Gymnasium; each task has two, for behaviours and for twists."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import gymnasium as gym

from refseq_bench.sim.envs.episodes.actions import ByBehaviour, ByTwist
from refseq_bench.sim.envs.worlds.rooms import FORMS

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


IDS = tuple(f"{NAMESPACE}/{name}{suffix}-v0" for name in TASKS for suffix in SUFFIXES.values())
"""All ids."""


def register() -> None:
    """Register all ids with Gymnasium."""
    made = ((seconds, made_with, actions) for seconds, made_with in TASKS.values() for actions in SUFFIXES)
    for name, (seconds, made_with, actions) in zip(IDS, made, strict=True):
        gym.register(
            name,
            entry_point="refseq_bench.sim.envs.robot_env:RobotEnv",
            vector_entry_point="refseq_bench.sim.envs.batch:BatchEnv",
            max_episode_steps=round(seconds / PERIODS[actions]),
            kwargs={**made_with, "actions": actions},
        )
