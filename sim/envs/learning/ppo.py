"""Learn a task with PPO of Stable-Baselines3.

Stable-Baselines3 and PyTorch are the extra ``rl``; they are imported when something is learnt, and not before.
"""

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from refseq.children import follow_parent
from refseq.files import replacing_at
from refseq_bench.sim.envs.learning.imitation import examples, imitate
from refseq_bench.sim.envs.learning.training_config import TrainingConfig, check_worlds, environment
from refseq_bench.sim.errors import SimError

ROLLOUT, BATCH = 2048, 128
"""Steps of all robots together between two updates, and those of one gradient; choices."""
SETTINGS: Mapping[str, Any] = {"batch_size": BATCH, "learning_rate": 5e-4, "policy_kwargs": {"log_std_init": -0.5}}
"""Where it differs from what Stable-Baselines3 does by itself: bolder steps, calmer hands."""


@dataclass(frozen=True, slots=True)
class Practice:
    """An episode that was learnt from: when it ended (``steps`` of all robots, ``seconds``), its return and length."""

    steps: int
    seconds: float
    returned: float
    length: int


@dataclass(frozen=True, slots=True)
class TrainedPolicy:
    """A finished training: its ``practice`` episode by episode, and after how many steps and seconds it ended."""

    practice: tuple[Practice, ...]
    steps: int
    seconds: float


def stable_baselines() -> ModuleType:
    """The learners' package; raises ``SimError`` where it is not installed."""
    try:
        import stable_baselines3
    except ImportError:
        raise SimError(
            "Stable-Baselines3 is not installed; valid is the extra rl: pip install '.[rl]' in a clone"
        ) from None
    module: ModuleType = stable_baselines3
    return module


def learn(config: TrainingConfig, policy: Path) -> TrainedPolicy:
    """Learn, and write what was learnt to ``policy`` (a .zip).

    A training that ends by its steps gives the same policy each time. Raises ``SimError`` without the extra ``rl``, and
    for worlds that the task cannot be made with.
    """
    began = time.monotonic()
    learners = stable_baselines()
    check_worlds(config)  # a worker would tell what is wrong in thirty lines

    import torch
    from stable_baselines3.common.vec_env import SubprocVecEnv

    torch.set_num_threads(1)  # the network is small, and the cores are the robots'
    robots = SubprocVecEnv([lambda: _practising(config)] * config.robots, start_method="spawn")
    practice: list[Practice] = []

    def after_step(seen: dict[str, Any], _: object) -> bool:
        steps, seconds = seen["self"].num_timesteps, time.monotonic() - began
        ended = [info["episode"] for info in seen["infos"] if "episode" in info]
        practice.extend(Practice(steps, seconds, float(one["r"]), int(one["l"])) for one in ended)
        return seconds < config.seconds

    try:
        rollout = BATCH * max(min(ROLLOUT, config.steps) // config.robots // BATCH, 1)
        learner = learners.PPO("MultiInputPolicy", robots, n_steps=rollout, seed=config.seed, device="cpu", **SETTINGS)
        if config.taught:
            imitate(learner.policy, examples(config), config.seed)
        if config.steps:
            learner.learn(config.steps, callback=after_step)
        with replacing_at(policy) as path:
            learner.save(path)
    finally:
        robots.close()
    return TrainedPolicy(tuple(practice), learner.num_timesteps, time.monotonic() - began)


def _practising(config: TrainingConfig) -> Any:
    """Begin a worker with an environment to practise in."""
    from stable_baselines3.common.monitor import Monitor

    follow_parent(os.getppid())

    return Monitor(environment(config.task, config.learnt_in))
