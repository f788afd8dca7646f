"""Imitation of the executor: a policy begins with what the executor does in missions, before it learns from rewards."""

from contextlib import closing
from typing import Any

import numpy as np

from refseq_bench.sim.envs.episodes.observations import Arrays
from refseq_bench.sim.envs.learning.executor_policy import ExecutorPolicy
from refseq_bench.sim.envs.learning.training_config import TrainingConfig, environment
from refseq_bench.sim.envs.robot_env import RobotEnv

EPOCHS, BATCH, RATE = 200, 64, 1e-3
"""Passes over all examples, examples of one gradient, and Adam's rate; choices."""
Examples = tuple[list[Arrays], list[int]]
"""Observations, and the executor's action at each."""


def examples(config: TrainingConfig) -> Examples:
    """The executor's observations and actions in ``config.taught`` episodes, seeded from the training's seed on."""
    observations, actions = list[Arrays](), list[int]()
    with closing(environment(config.task, config.learnt_in)) as env:
        unwrapped = env.unwrapped
        assert isinstance(unwrapped, RobotEnv)
        for number in range(config.taught):
            seen, info = env.reset(seed=config.seed + number)
            play, over = ExecutorPolicy(unwrapped), False
            while not over:
                observations.append(seen)
                actions.append(play(seen, info))
                seen, _, ended, cut, info = env.step(actions[-1])
                over = ended or cut
    return observations, actions


def imitate(policy: Any, shown: Examples, seed: int) -> float:
    """Fit a policy of Stable-Baselines3 to examples by maximum likelihood; returns the last mean loss [nats]."""
    import torch

    observations, actions = shown
    stacked = {key: np.stack([one[key] for one in observations]) for key in observations[0]}
    inputs, _ = policy.obs_to_tensor(stacked)
    targets = torch.as_tensor(actions, device=policy.device)
    optimiser, rng = torch.optim.Adam(policy.parameters(), lr=RATE), np.random.default_rng(seed)
    losses: list[float] = []
    for _ in range(EPOCHS):
        order, losses = rng.permutation(len(actions)), []
        for first in range(0, len(order), BATCH):
            rows = torch.as_tensor(order[first : first + BATCH])
            _, likelihood, _ = policy.evaluate_actions({key: part[rows] for key, part in inputs.items()}, targets[rows])
            loss = -likelihood.mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(float(loss.detach()))
    return float(np.mean(losses))
