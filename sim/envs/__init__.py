"""Gymnasium environments of robots in worlds; importing this package registers them all.

    import gymnasium, refseq_bench.sim.envs
    env = gymnasium.make("refseq/FollowCorridor-v0", world="corridor:3")

``gymnasium.make("refseq_bench.sim.envs:refseq/FollowCorridor-v0")`` imports the package by itself.
``docs/gymnasium.md`` has the tasks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from refseq_bench.sim.envs.registry import IDS, register, register_task

if TYPE_CHECKING:
    from refseq_bench.sim.envs.batch import BatchEnv
    from refseq_bench.sim.envs.robot_env import RobotEnv
    from refseq_bench.sim.envs.tasks.task import Episode, Judgement, Situation, Task, TaskGround

__all__ = [
    "IDS",
    "BatchEnv",
    "Episode",
    "Judgement",
    "RobotEnv",
    "Situation",
    "Task",
    "TaskGround",
    "register_task",
]

register()
_HOMES = {
    "batch": ("BatchEnv",),
    "robot_env": ("RobotEnv",),
    "tasks.task": ("Episode", "Judgement", "Situation", "Task", "TaskGround"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a class on first use: registering the ids costs little."""
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
