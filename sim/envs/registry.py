"""Registration of the environments' ids with Gymnasium; each task has two, for behaviours and for twists."""

from collections.abc import Mapping, Sequence
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import gymnasium as gym
from gymnasium.envs.registration import get_env_id, parse_env_id

from refseq_bench.sim.envs.episodes.actions import ByBehaviour, ByTwist
from refseq_bench.sim.envs.worlds.rooms import FORMS
from refseq_bench.sim.errors import SimError

if TYPE_CHECKING:
    from refseq_bench.sim.envs.tasks.task import Task

NAMESPACE = "refseq"
CORRIDORS = [f"corridor:{seed}" for seed in range(16)]
"""The corridors that are driven along where nothing else is asked for; others are for trying out what was learnt."""
ROOMS = [f"rooms:{form}" for form in range(len(FORMS))]
PERIODS = {"behaviours": ByBehaviour.period, "twist": ByTwist.period}
SUFFIXES = {"behaviours": "", "twist": "Twist"}

TASKS: Mapping[str, tuple[float, Mapping[str, Any]]] = MappingProxyType(
    {
        "FollowCorridor": (400.0, {"task": "follow-corridor", "world": CORRIDORS}),
        "CrossDoor": (60.0, {"task": "cross-door", "world": ROOMS}),
        "ReachPlace": (120.0, {"task": "reach-place", "world": "laboratory"}),
        "Recover": (120.0, {"task": "recover", "world": "laboratory"}),
        "Mission": (180.0, {"task": "run-mission", "world": "offices"}),
    }
)
"""The time limit of each task [s], if all actions last as long as they may, and what makes it; choices."""

LONGEST = 1e9
"""Time limit of an episode at most [s], some 30 years; a choice: whoever wants none asks for this."""

IDS = tuple(f"{NAMESPACE}/{name}{suffix}-v0" for name in TASKS for suffix in SUFFIXES.values())
"""All ids of the bench's own tasks."""


def register() -> None:
    """Register all ids with Gymnasium."""
    for name, (seconds, made_with) in TASKS.items():
        _register(f"{NAMESPACE}/{name}-v0", seconds, made_with)


def register_task(
    name: str, task: "type[Task]", *, world: str | Sequence[str], seconds: float, **made_with: Any
) -> tuple[str, ...]:
    """Register a task of your own with Gymnasium as ``namespace/Name-v0``, and as ``namespace/NameTwist-v0``.

    ``world`` is a name, or several of which each episode draws one; ``seconds`` [s] is the time limit of an episode, if
    all actions last as long as they may; ``made_with`` are other keywords of ``RobotEnv``, such as ``route``. Returns
    the ids. The class has to lie at the top of a module, where workers find it. Raises ``SimError`` for ``seconds``
    that are not above 0 or beyond ``LONGEST``, a name that is none, and a class that is not found.
    """
    from refseq_bench.sim.envs.tasks.by_name import name_of

    if not (isinstance(seconds, Real) and 0 < seconds <= LONGEST):
        raise SimError(f"seconds = {seconds!r:.60} is not valid; valid is more than 0, and {LONGEST:.0f} at most")
    return _register(name, seconds, {"task": name_of(task), "world": world, **made_with})


def _register(name: str, seconds: float, made_with: Mapping[str, Any]) -> tuple[str, ...]:
    try:
        namespace, stem, version = parse_env_id(name)
    except (gym.error.Error, TypeError) as error:
        raise SimError(f"name {name!r:.60} is not valid; valid is one such as 'mine/GoHome-v0'") from error
    ids = {actions: get_env_id(namespace, f"{stem}{suffix}", version) for actions, suffix in SUFFIXES.items()}
    for actions, one in ids.items():
        gym.register(
            one,
            entry_point="refseq_bench.sim.envs.robot_env:RobotEnv",
            vector_entry_point="refseq_bench.sim.envs.batch:BatchEnv",
            max_episode_steps=max(1, round(seconds / PERIODS[actions])),
            kwargs={**made_with, "actions": actions},
        )
    return tuple(ids.values())
