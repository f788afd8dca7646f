"""Steps a second of the environments: one, eight in workers or in a batch, one with two cameras.

What is held are ratios within one run; the figures are printed (``-s``). One environment's are of the processor, which
a busy machine disturbs less than the clock; those of workers are of the clock, as they share the cores.
"""

import os
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from refseq_bench.robots.robuter.control import RobuterControl
from refseq_bench.sim.envs.episodes.actions import ByBehaviour
from refseq_bench.sim.envs.registry import NAMESPACE, PERIODS, SUFFIXES, TASKS
from refseq_bench.sim.envs.vector import LayoutBatch
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.sim.sensors.sonar import SonarRing
from tests.benchmarks.stopwatch import Stopwatch

pytestmark = pytest.mark.benchmark
SECONDS = 8.0
VECTOR = 8
CORRIDOR = "corridor:3"
TWIST = "refseq/FollowCorridorTwist-v0"


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


@pytest.mark.parametrize("task", TASKS)
def test_behaviours_cost_little_more_than_the_twists_of_their_time(task: str) -> None:
    simulated = {}
    for actions, suffix in SUFFIXES.items():
        name = f"{NAMESPACE}/{task}{suffix}-v0"
        clock, processor = single(name)
        simulated[actions] = processor * PERIODS[actions]
        print(f"\n{name:32s} {processor:6.1f} steps/s of a core, {clock:6.1f} by the clock", end="")
        print(f", {simulated[actions]:.1f} s of the robot's", end="")
    # Both simulate the same robot: what is learnt by trying has to be faster than trying it out on the real one, and
    # to decide what to do next never takes longer than all that it is decided for.
    assert min(simulated.values()) > 1
    assert simulated["behaviours"] > 0.5 * simulated["twist"]


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
    for renderer in ("filament", "baked", "classic"):
        seeing, _ = single(TWIST, world=CORRIDOR, cameras=["camera-1", "camera-2"], renderer=renderer)
        print(f", with two by {renderer} {seeing:.2f}, one of {blind / seeing:.0f}", end="")
        assert 2 * seeing < blind


MODES: dict[str, dict[str, Any]] = {
    "sync": {"vectorization_mode": "sync"},
    "workers": {"vectorization_mode": "async", "vector_kwargs": {"context": "spawn"}},
    "batch, 1 thread": {"vectorization_mode": "vector_entry_point", "threads": 1},
    "batch": {"vectorization_mode": "vector_entry_point"},
}
ROUNDS = 12


@pytest.mark.parametrize("name", [TWIST, "refseq/FollowCorridor-v0"])
def test_a_batch_costs_no_more_than_one_after_the_other(name: str) -> None:
    """All do the same steps, by turns: ratios are those of neighbours in time, whatever else the machine does."""
    vectors = {mode: gym.make_vec(name, VECTOR, **options, world=CORRIDOR) for mode, options in MODES.items()}
    vectors["one"] = gym.make_vec(name, 1, vectorization_mode="sync", world=CORRIDOR)
    drawn = vectors["sync"].action_space
    drawn.seed(0)
    for envs in vectors.values():
        envs.reset(seed=0)
    took: dict[str, list[float]] = {mode: [] for mode in vectors}
    for _ in range(ROUNDS):
        actions = [drawn.sample() for _ in range(4 if "Twist" in name else 1)]
        for mode, envs in vectors.items():
            began = time.perf_counter()
            for action in actions:
                envs.step(action[: envs.num_envs])
            took[mode].append((time.perf_counter() - began) / len(actions) / envs.num_envs)
    load = os.getloadavg()[0]
    print(f"\n{name}, {VECTOR} robots, load {load:.1f}", end="")
    for mode, seconds in took.items():
        vectors[mode].close()
        ratio = np.median(np.array(took["sync"]) / seconds)
        print(f"\n    {mode:16s} {1 / np.median(seconds):6.1f} steps/s, {ratio:.2f} times sync", end="")
    assert np.median(np.array(took["batch"]) / took["sync"]) < 1.25


@pytest.mark.parametrize("name", [TWIST, "refseq/FollowCorridor-v0"])
def test_where_the_time_of_a_batch_goes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """On one thread, of the processor; of all this only the physics are spread over cores."""
    envs = gym.make_vec(name, VECTOR, vectorization_mode="vector_entry_point", threads=1, world=CORRIDOR)
    envs.action_space.seed(0)
    envs.reset(seed=0)
    watch = Stopwatch()
    watch.watch(monkeypatch, Batch, "step", "physics")
    watch.watch(monkeypatch, LayoutBatch, "step", "states to and fro")
    watch.watch(monkeypatch, mujoco, "mj_multiRay", "rays")
    watch.watch(monkeypatch, Laser, "scan", "laser")
    watch.watch(monkeypatch, SonarRing, "read", "sonars")
    watch.watch(monkeypatch, RobuterControl, "tick", "electronics")
    watch.watch(monkeypatch, ByBehaviour, "step", "behaviours")
    with watch.counting("the rest"):
        for _ in range(40 if "Twist" in name else 10):
            envs.step(envs.action_space.sample())
    spent = {part: both[1] for part, both in watch.spent.items() if part != "other"}
    whole = sum(spent.values())
    print(f"\n{name}: " + ", ".join(f"{part} {100 * one / whole:.0f} %" for part, one in spent.items()), end="")
    assert spent["physics"] < whole / 2
