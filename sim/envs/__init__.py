"""Gymnasium environments of robots in worlds; importing this package registers them all.

    import gymnasium, refseq_bench.sim.envs
    env = gymnasium.make("RefSeq/FollowCorridor-v0", world="corridor:3")

``gymnasium.make("refseq_bench.sim.envs:RefSeq/FollowCorridor-v0")`` imports the package by itself.
``docs/gymnasium.md`` has the tasks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from refseq_bench.sim.envs.registry import IDS, register

if TYPE_CHECKING:
    from refseq_bench.sim.envs.batch import BatchEnv
    from refseq_bench.sim.envs.robot_env import RobotEnv

__all__ = ["IDS", "BatchEnv", "RobotEnv"]

register()
_HOMES = {"BatchEnv": "batch", "RobotEnv": "robot_env"}


def __getattr__(name: str) -> Any:
    """Import an environment's class on first use: registering the ids costs little."""
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
