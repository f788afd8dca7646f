"""Evaluation of a learnt policy beside chance and beside going ahead, on episodes that nobody learnt from."""

import multiprocessing
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from refseq.children import follow_parent
from refseq_bench.sim.envs.learning.executor_policy import ExecutorPolicy
from refseq_bench.sim.envs.learning.ppo import stable_baselines
from refseq_bench.sim.envs.learning.training_config import FIRST_TRIED, MISSIONS, TrainingConfig, environment
from refseq_bench.sim.envs.robot_env import RobotEnv

Player = Callable[[Any, dict[str, Any]], Any]
"""From an observation and its info to an action."""
PLAYERS = ("learnt", "random", "ahead")
"""The learnt policy, without chance; any action at any time; and always full speed ahead, or the first behaviour."""
EXECUTOR = "executor"
"""In missions a fourth: the Tactical layer (``ExecutorPolicy``)."""
CONFIDENCE = 0.95
ACTION_STREAM = 43
"""Keeps the random player's numbers apart from those that draw the episode, which come from the same seed."""


@dataclass(frozen=True, slots=True)
class EvaluationEpisode:
    """An episode by one of ``players``, in a ``world``, drawn by a ``seed``; ``success``: it got to the goal."""

    player: str
    world: str
    seed: int
    returned: float
    length: int
    success: bool


@dataclass(frozen=True, slots=True)
class Margin:
    """By how much one player's mean return is larger than another's, and its interval of 95 %.

    The interval is the percentile bootstrap's over pairs of episodes with the same world and seed.
    """

    mean: float
    low: float
    high: float


def evaluate(config: TrainingConfig, policy: Path) -> tuple[EvaluationEpisode, ...]:
    """Let all players play the same episodes, in as many processes as the configuration has robots."""
    worlds = config.tried_in
    numbered = [(worlds[i % len(worlds)], FIRST_TRIED + i) for i in range(config.episodes)]
    spawned = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        config.robots, mp_context=spawned, initializer=follow_parent, initargs=(os.getpid(),)
    ) as workers:
        episodes = [
            workers.submit(_tried, config.task, policy, player, world, seed)
            for player, (world, seed) in product(players(config.task), numbered)
        ]
        return tuple(episode.result() for episode in episodes)


def players(task: str) -> tuple[str, ...]:
    """Everyone who plays the same episodes of a task."""
    return (*PLAYERS, EXECUTOR) if task == MISSIONS else PLAYERS


def _tried(task: str, policy: Path, player: str, world: str, seed: int) -> EvaluationEpisode:
    env = environment(task, (world,))
    seen, info = env.reset(seed=seed)
    play = _player(player, policy, env, seed)
    total, length, over = 0.0, 0, False
    while not over:
        seen, reward, ended, cut, info = env.step(play(seen, info))
        total, length, over = total + float(reward), length + 1, ended or cut
    env.close()
    return EvaluationEpisode(player, world, seed, total, length, bool(info["success"]))


def _player(name: str, policy: Path, env: gym.Env[Any, Any], seed: int) -> Player:
    """A player of the episode that an environment has just begun."""
    actions = env.action_space
    if name == EXECUTOR:
        unwrapped = env.unwrapped
        assert isinstance(unwrapped, RobotEnv)
        return ExecutorPolicy(unwrapped)
    if name == "learnt":
        import torch

        torch.set_num_threads(1)
        learner = stable_baselines().PPO.load(policy, device="cpu")
        return lambda seen, _: learner.predict(seen, deterministic=True)[0]
    if name == "random":
        return random_player(env, seed)
    ahead: Any = np.array([1.0, 0.0], np.float32) if isinstance(actions, spaces.Box) else 0
    return lambda _seen, _info: ahead


def random_player(env: gym.Env[Any, Any], seed: int) -> Player:
    """A player of any action at any time, whose ``seed`` may be the episode's."""
    actions = env.action_space
    actions.seed(int(np.random.SeedSequence((ACTION_STREAM, seed)).generate_state(1)[0]))
    return lambda _seen, _info: actions.sample()


def returns(episodes: tuple[EvaluationEpisode, ...]) -> Mapping[str, NDArray[np.float64]]:
    """The returns of each player, in the order of the episodes."""
    names = dict.fromkeys(one.player for one in episodes)
    return {name: np.array([one.returned for one in episodes if one.player == name]) for name in names}


def margin(better: NDArray[np.float64], worse: NDArray[np.float64]) -> Margin:
    """By how much the returns ``better`` (n,) are larger than ``worse`` (n,), of the same episodes."""
    from scipy.stats import bootstrap  # a second to import, which only an evaluation waits for

    gains = better - worse
    found = bootstrap((gains,), np.mean, confidence_level=CONFIDENCE, method="percentile", rng=np.random.default_rng(0))
    return Margin(float(gains.mean()), *map(float, found.confidence_interval))
