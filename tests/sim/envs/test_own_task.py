"""Tasks of one's own: registered under two ids, made from JSON and in workers, held to Gymnasium's checks."""

import math
import warnings
from collections.abc import Iterator
from itertools import pairwise
from typing import cast

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from refseq_bench.sim.envs import Episode, RobotEnv, TaskGround, register_task
from refseq_bench.sim.envs.tasks.by_name import TASKS, task_named
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import gl_backend
from tests.sim.envs import go_home
from tests.sim.envs.go_home import GoHome, Homewards

WHERE = go_home.__name__


@pytest.fixture
def ids() -> Iterator[tuple[str, ...]]:
    ids = register_task("mine/GoHome-v1", GoHome, world="corridor:3", seconds=30, renderer="classic")
    yield ids
    for name in ids:
        del gym.registry[name]


def test_it_goes_by_two_ids_with_its_limit_in_steps_of_each_kind(ids: tuple[str, ...]) -> None:
    assert ids == ("mine/GoHome-v1", "mine/GoHomeTwist-v1")
    assert [gym.spec(name).max_episode_steps for name in ids] == [30, 150]


@pytest.mark.slow
@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_gymnasium_has_nothing_to_say_against_it(ids: tuple[str, ...]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(ids[1])
        check_env(env.unwrapped)
    env.close()


def test_its_rewards_are_the_way_that_was_made_good(ids: tuple[str, ...]) -> None:
    env = gym.make(EnvSpec.from_json(gym.spec(ids[1]).to_json()))
    _, info = env.reset(seed=4)
    begun, rewards = info["distance_to_goal"], []
    for _ in range(10):
        _, reward, ended, _, info = env.step(np.array([0.6, 0.0], np.float32))
        rewards.append(reward)
        assert not ended
    env.close()
    assert sum(rewards) == pytest.approx(begun - info["distance_to_goal"])
    assert sum(rewards) > 0.3


def test_a_class_is_as_good_as_its_name() -> None:
    assert task_named(f"{WHERE}:GoHome") is GoHome
    for task in (GoHome, f"{WHERE}:GoHome"):
        env = RobotEnv(task, "corridor:3")
        assert env.behaviours == GoHome.behaviours
        env.close()


@pytest.mark.parametrize("turns", [False, True])
def test_the_robot_stands_as_the_task_says_whether_it_needs_room_to_turn_or_not(turns: bool) -> None:
    class Turning(GoHome): ...

    Turning.turns = turns
    env = RobotEnv(Turning, "corridor:3")
    _, info = env.reset(seed=4)
    start = env._running.episode.start
    env.close()
    assert info["pose"] == pytest.approx([start.x, start.y, start.heading], abs=0.02)


def test_each_episode_has_noise_of_its_own() -> None:
    class FromHere(GoHome):
        def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
            return Homewards(ground, ground.way.pose(4.0, 0.0, math.pi))

    env = RobotEnv(FromHere, "corridor:3")
    first, again, other, next_one = (env.reset(seed=seed)[0]["scan"] for seed in (1, 1, 2, None))
    env.close()
    assert np.array_equal(first, again)
    assert not any(np.array_equal(one, two) for one, two in pairwise([first, other, next_one, first]))


def test_workers_find_it(ids: tuple[str, ...]) -> None:
    made = gym.make_vec(ids[1], 1, vectorization_mode="async", vector_kwargs={"context": "spawn"})
    seen, _ = made.reset(seed=[3])
    made.close()
    alone = gym.make(ids[1])
    expected, _ = alone.reset(seed=3)
    alone.close()
    assert np.array_equal(seen["scan"][0], expected["scan"])


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("go-home", f"unknown task 'go-home': valid are {', '.join(TASKS)}, or package.module:Class"),
        ("no_such_module:Task", "task 'no_such_module:Task' is not found: No module named 'no_such_module'"),
        (f"{WHERE}:Nobody", f"task '{WHERE}:Nobody' is not found: module '{WHERE}' has no attribute 'Nobody'"),
        (f"{WHERE}:Pose", "is not valid; valid is a subclass of refseq_bench.sim.envs.tasks.task.Task"),
        (f"{WHERE}:WithoutEpisodes", "task WithoutEpisodes has no method episode"),
        (f"{WHERE}:WithoutBehaviours", "task WithoutBehaviours has no behaviours; valid is a tuple such as"),
    ],
)
def test_a_task_that_cannot_be_is_told_in_one_line(name: str, told: str) -> None:
    with pytest.raises(SimError) as caught:
        RobotEnv(name, "corridor:3")
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_workers_could_not_find_is_not_registered() -> None:
    class Inside(GoHome):
        pass

    with pytest.raises(SimError, match=r"Inside lies in a function; valid is a class at the top of a module$"):
        register_task("mine/Inside-v0", Inside, world="corridor:3", seconds=30)
    for seconds in (0, -1.0, math.nan, math.inf, "10", 10**400):
        with pytest.raises(SimError, match=r"^seconds = .{1,60} is not valid; valid is more than 0, and 1000000000 at"):
            register_task("mine/GoHome-v0", GoHome, world="corridor:3", seconds=cast(float, seconds))
    for name in ("mine/Go home-v0", "mine/", "", 3):
        with pytest.raises(SimError, match=r"^name .* is not valid; valid is one such as 'mine/GoHome-v0'$"):
            register_task(cast(str, name), GoHome, world="corridor:3", seconds=30)
    assert not [name for name in gym.registry if name.startswith("mine/")]
