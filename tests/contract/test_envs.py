"""What holds for every environment that is registered: Gymnasium's own checks, repeatability, in workers too."""

import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence

import refseq_bench.sim.envs
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device

IDS = sorted(name for name, spec in gym.registry.items() if spec.namespace == "refseq")
CHECKED = ("refseq/FollowCorridor-v0",)
"""Those that Gymnasium checks each time, as it resets them a dozen times."""
IN_WORKERS = ("refseq/CrossDoorTwist-v0",)
STEPS = 6
every_id = pytest.mark.parametrize("name", IDS)


def some(quick: tuple[str, ...]) -> pytest.MarkDecorator:
    """Every id, of which only a few are quick enough for each run."""
    return pytest.mark.parametrize(
        "name", [pytest.param(name, marks=[] if name in quick else [pytest.mark.slow]) for name in IDS]
    )


def test_there_is_something_to_try() -> None:
    assert set(IDS) >= set(refseq_bench.sim.envs.IDS) >= {*CHECKED, *IN_WORKERS}
    tasks = ("FollowCorridor", "CrossDoor", "ReachPlace", "Recover", "Mission")
    assert set(refseq_bench.sim.envs.IDS) == {f"refseq/{task}{form}-v0" for task in tasks for form in ("", "Twist")}


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
@some(CHECKED)
def test_gymnasium_has_nothing_to_say_against_it(name: str) -> None:
    checked(name, renderer="classic")


@pytest.mark.slow
@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
@every_id
def test_nor_with_a_robot_that_balances(name: str) -> None:
    checked(name, renderer="classic", robot="segway_rmp")


@pytest.mark.slow
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")
@every_id
def test_nor_with_the_renderer_that_is_the_default(name: str) -> None:
    checked(name)


def checked(name: str, **made_with: Any) -> None:
    """Gymnasium's checks, with nothing left out; what it warns of is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(name, **made_with)
        check_env(env.unwrapped)
        env.close()


@pytest.mark.quick_cases("refseq/CrossDoor-v0", "refseq/FollowCorridorTwist-v0", "refseq/MissionTwist-v0")
@every_id
def test_the_same_seed_and_actions_are_the_same_episode_again_of_numbers_within_bounds(name: str) -> None:
    env = gym.make(name)
    actions = drawn_actions(env)
    first, other, again = (list(played(env, seed, actions)) for seed in (3, 4, 3))
    assert len(first) == len(actions) + 1
    assert all(data_equivalence(one, two, exact=True) for one, two in zip(first, again, strict=True))
    assert not data_equivalence(first[-1], other[-1], exact=True)
    for observation, *_ in (*first, *other):
        assert observation in env.observation_space
        assert {part.dtype for part in observation.values()} == {np.dtype(np.float32)}
        assert all(np.isfinite(part).all() for part in observation.values())
    env.close()


@pytest.mark.quick_cases("refseq/CrossDoorTwist-v0", "refseq/FollowCorridor-v0")
@every_id
def test_it_is_made_again_from_what_its_spec_says_as_json(name: str) -> None:
    env = gym.make(name, belief="places")
    assert env.spec is not None
    spec = EnvSpec.from_json(env.spec.to_json())
    again = gym.make(spec)
    assert again.spec == env.spec
    actions = drawn_actions(env)[:2]
    pairs = zip(played(env, 3, actions), played(again, 3, actions), strict=True)
    assert all(data_equivalence(one, two, exact=True) for one, two in pairs)
    env.close()
    again.close()


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
@pytest.mark.quick_cases("refseq/CrossDoorTwist-v0")
@every_id
def test_who_takes_pictures_changes_nothing_else(name: str) -> None:
    """Not one range, belief or pose: the laser neither turns for a picture nor draws from its noise."""
    blind, seeing = gym.make(name), gym.make(name, cameras=["camera-1"], pixels=16, renderer="classic")
    actions = drawn_actions(blind)
    for one, other in zip(played(blind, 3, actions), played(seeing, 3, actions), strict=True):
        assert other[0].pop("camera-1").shape == (16, 16)
        assert data_equivalence(one, other, exact=True)
    blind.close()
    seeing.close()


@some(IN_WORKERS)
def test_workers_see_step_by_step_what_one_process_sees(name: str) -> None:
    env = gym.make(name)
    actions = drawn_actions(env)
    alone = [list(played(env, seed, actions)) for seed in (3, 4)]
    env.close()
    workers = gym.make_vec(name, num_envs=2, vectorization_mode="async", vector_kwargs={"context": "spawn"})
    seen, infos = workers.reset(seed=[3, 4])
    together = [(seen, (0.0, 0.0), (False, False), infos)]
    for action in actions:
        seen, rewards, ended, _, infos = workers.step(np.stack([action, action]))
        together.append((seen, rewards, ended, infos))
    workers.close()
    for number, episode in enumerate(alone):
        for (seen, reward, over, told), (observations, rewards, ended, infos) in zip(episode, together, strict=True):
            assert all(np.array_equal(seen[key], observations[key][number]) for key in seen)
            assert (reward, over) == (rewards[number], ended[number])
            assert all(np.array_equal(value, infos[key][number]) for key, value in told.items())


def drawn_actions(env: gym.Env[Any, Any]) -> list[Any]:
    """A few actions, the same ones each time; none leads anybody into a wall at once."""
    env.action_space.seed(1)
    return [env.action_space.sample() for _ in range(STEPS)]


def played(env: gym.Env[Any, Any], seed: int, actions: list[Any]) -> Iterator[tuple[Any, float, bool, dict[str, Any]]]:
    """Observation, reward, whether it is over, and info, from the reset on."""
    observation, info = env.reset(seed=seed)
    yield observation, 0.0, False, info
    for action in actions:
        observation, reward, ended, truncated, info = env.step(action)
        assert not truncated
        yield observation, float(reward), ended, info
