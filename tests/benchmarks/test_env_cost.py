"""Steps a second of the environments: one, a vector of eight in workers, one with two cameras.

What is held are ratios within one run; the figures are printed (``-s``). One environment's are of the processor, which
a busy machine disturbs less than the clock; those of workers are of the clock, as they share the cores.
"""

import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import sim.envs
from sim.drivers import gl_backend, vulkan_device

pytestmark = pytest.mark.benchmark
SECONDS = 8.0
VECTOR = 8
CORRIDOR = "corridor:3"
TWIST = "RefSeq/FollowCorridorTwist-v0"


def rates(step: Callable[[], int]) -> tuple[float, float]:
    """Steps a second by the clock and by the processor; ``step`` says how many it did."""
    for _ in range(5):
        step()
    steps, began = 0, np.array([time.perf_counter(), time.process_time()])
    spent = np.zeros(2)
    while spent[0] < SECONDS:
        steps += step()
        spent = np.array([time.perf_counter(), time.process_time()]) - began
    return steps / float(spent[0]), steps / float(spent[1])


def single(name: str, **made_with: Any) -> tuple[float, float]:
    """One environment, actions at random, resets counted in."""
    env = gym.make(name, **made_with)
    env.action_space.seed(0)
    env.reset(seed=0)

    def step() -> int:
        _, _, ended, truncated, _ = env.step(env.action_space.sample())
        if ended or truncated:
            env.reset()
        return 1

    found = rates(step)
    env.close()
    return found


def vector(name: str, **made_with: Any) -> float:
    """Eight environments in workers, actions at random; steps a second by the clock."""
    spawned = {"context": "spawn"}
    envs = gym.make_vec(name, VECTOR, vectorization_mode="async", vector_kwargs=spawned, **made_with)
    envs.action_space.seed(0)
    envs.reset(seed=0)

    def step() -> int:
        envs.step(envs.action_space.sample())
        return VECTOR

    found, _ = rates(step)
    envs.close()
    return found


@pytest.mark.parametrize("name", sim.envs.IDS)
def test_steps_a_second_of_each(name: str) -> None:
    clock, processor = single(name)
    print(f"\n{name:32s} {processor:6.1f} steps/s of a core, {clock:6.1f} by the clock", end="")


@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_a_reset_costs_no_more_than_some_steps(robot: str) -> None:
    """In a world that was met before: a bench of its own for each episode is cheap without pictures."""
    env = gym.make(TWIST, robot=robot, world=CORRIDOR)
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


def test_workers_bring_more_than_they_cost() -> None:
    (alone, _), together = single(TWIST, world=CORRIDOR), vector(TWIST, world=CORRIDOR)
    print(
        f"\n{TWIST}: one {alone:.0f}, {VECTOR} in workers {together:.0f} steps/s: {together / alone:.2f} times", end=""
    )
    # They wait for each other after every step, and others use this machine's cores as well.
    assert together > 0.5 * alone


@pytest.mark.skipif(vulkan_device() is None or gl_backend() is None, reason="a renderer does not start")
def test_what_cameras_cost() -> None:
    blind, _ = single(TWIST, world=CORRIDOR)
    print(f"\n{TWIST}: without cameras {blind:.0f} steps/s", end="")
    for renderer in ("filament", "classic"):
        seeing, _ = single(TWIST, world=CORRIDOR, cameras=["camera-1", "camera-2"], renderer=renderer)
        print(f", with two by {renderer} {seeing:.2f}, one of {blind / seeing:.0f}", end="")
        assert 2 * seeing < blind
