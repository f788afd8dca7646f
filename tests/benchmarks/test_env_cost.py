"""Steps a second of the environments: one, a vector of eight in workers, one with two cameras.

What is held are ratios within one run; the figures are printed (``-s``).
"""

import os
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import sim.envs
from sim.drivers import vulkan_device

pytestmark = pytest.mark.benchmark
SECONDS = 8.0
VECTOR = 8
TWIST = "RefSeq/FollowCorridorTwist-v0"


def rate(step: Callable[[], int]) -> float:
    """Steps a second by the clock; ``step`` says how many it did."""
    for _ in range(5):
        step()
    steps, began = 0, time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        steps += step()
    return steps / (time.perf_counter() - began)


def single(name: str, **made_with: Any) -> float:
    """One environment, actions at random, resets counted in."""
    env = gym.make(name, **made_with)
    env.action_space.seed(0)
    env.reset(seed=0)

    def step() -> int:
        _, _, ended, truncated, _ = env.step(env.action_space.sample())
        if ended or truncated:
            env.reset()
        return 1

    found = rate(step)
    env.close()
    return found


def vector(name: str, mode: str) -> float:
    """Eight environments at once, actions at random."""
    options = {"vector_kwargs": {"context": "spawn"}} if mode == "async" else {}
    envs = gym.make_vec(name, num_envs=VECTOR, vectorization_mode=mode, **options)
    envs.action_space.seed(0)
    envs.reset(seed=0)

    def step() -> int:
        envs.step(envs.action_space.sample())
        return VECTOR

    found = rate(step)
    envs.close()
    return found


@pytest.mark.parametrize("name", sim.envs.IDS)
def test_steps_a_second_of_each(name: str) -> None:
    print(f"\n{name:32s} {single(name):6.1f} steps/s", end="")


@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_a_reset_costs_no_more_than_some_steps(robot: str) -> None:
    """In a world that was met before: a bench of its own for each episode is cheap without pictures."""
    env = gym.make(TWIST, robot=robot, world="corridor:3")
    env.reset(seed=0)
    resets, steps = [], []
    for number in range(10):
        began = time.perf_counter()
        env.reset(seed=number)
        resets.append(time.perf_counter() - began)
        for _ in range(10):
            began = time.perf_counter()
            env.step(np.array([0.5, 0.0], np.float32))
            steps.append(time.perf_counter() - began)
    print(f"\n{robot}: reset {1e3 * np.median(resets):.1f} ms, step {1e3 * np.median(steps):.1f} ms", end="")
    assert np.median(resets) < 20 * np.median(steps)


def test_a_vector_in_workers_uses_the_cores() -> None:
    alone, workers = single(TWIST), vector(TWIST, "async")
    print(f"\n{TWIST}: one {alone:.0f}, {VECTOR} in workers {workers:.0f} steps/s, x{workers / alone:.2f}", end="")
    cores = len(os.sched_getaffinity(0))
    assert workers > (0.6 * min(cores, VECTOR) if cores > 1 else 0.5) * alone


@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")
def test_what_cameras_cost() -> None:
    blind = single(TWIST, world="corridor:3")
    print(f"\n{TWIST}: without cameras {blind:.0f} steps/s", end="")
    for renderer in ("filament", "classic"):
        seeing = single(TWIST, world="corridor:3", cameras=["camera-1", "camera-2"], renderer=renderer)
        print(f", with two by {renderer} {seeing:.2f} (1/{blind / seeing:.0f})", end="")
        assert seeing < blind
