"""Environments in a batch against as many by themselves, and against what Gymnasium asks of a vector."""

import json
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from numpy.typing import NDArray

import refseq_bench.sim.envs
from refseq_bench.sim.envs.batch import BatchEnv
from refseq_bench.sim.errors import SimError

TWIST = "refseq/CrossDoorTwist-v0"
CORRIDORS = ["corridor:3", "corridor:10"]
"""Two that are not alike: their robots are stepped in two calls."""
Results = tuple[Any, list[float], list[bool], list[bool], list[dict[str, Any]]]


def batch(name: str, number: int = 3, **made_with: Any) -> BatchEnv:
    envs = gym.make_vec(name, num_envs=number, vectorization_mode="vector_entry_point", **made_with).unwrapped
    assert isinstance(envs, BatchEnv)
    return envs


class Singles:
    """Environments that each go by themselves, begun anew in the step after their end."""

    def __init__(self, name: str, number: int, **made_with: Any) -> None:
        self._envs = [gym.make(name, **made_with) for _ in range(number)]
        self._over = [False] * number

    def reset(self, seed: int) -> tuple[list[Any], list[dict[str, Any]]]:
        begun = [env.reset(seed=seed + i) for i, env in enumerate(self._envs)]
        return [seen for seen, _ in begun], [info for _, info in begun]

    def step(self, actions: Any) -> list[tuple[Any, float, bool, bool, dict[str, Any]]]:
        results = []
        for i, env in enumerate(self._envs):
            if self._over[i]:
                seen, info = env.reset()
                results.append((seen, 0.0, False, False, info))
            else:
                results.append(env.step(actions[i]))  # type: ignore[arg-type]
            self._over[i] = results[-1][2] or results[-1][3]
        return results


def same(infos: dict[str, Any], info: dict[str, Any], robot: int) -> bool:
    """Whether what is told of a robot is what a single environment tells."""
    assert {key for key in infos if not key.startswith("_")} == set(info)
    assert all(infos[f"_{key}"][robot] for key in info)
    return all(np.array_equal(infos[key][robot], info[key]) for key in info)


def backward(envs: BatchEnv, steps: int) -> Iterator[NDArray[np.float32]]:
    """Into the wall behind, each at its own pace: some end sooner than others."""
    for _ in range(steps):
        yield np.linspace([-1.0, 0.0], [-0.6, 0.2], envs.num_envs, dtype=np.float32)


def sampled(envs: BatchEnv, steps: int) -> Iterator[Any]:
    envs.action_space.seed(7)
    for _ in range(steps):
        yield envs.action_space.sample()


CASES = [
    pytest.param(TWIST, backward, 36, {}, id="collisions"),
    pytest.param(TWIST, sampled, 8, {"robot": "segway_rmp"}, id="balancing"),
    pytest.param("refseq/CrossDoor-v0", sampled, 6, {}, id="behaviours"),
    pytest.param(
        "refseq/FollowCorridorTwist-v0", sampled, 12, {"max_episode_steps": 5, "world": CORRIDORS}, id="cut-off"
    ),
    pytest.param("refseq/FollowCorridor-v0", sampled, 3, {"world": CORRIDORS}, id="corridors"),
    pytest.param("refseq/ReachPlace-v0", sampled, 4, {}, id="with-a-map", marks=pytest.mark.slow),
    pytest.param("refseq/RecoverTwist-v0", sampled, 4, {}, id="led", marks=pytest.mark.slow),
]


@pytest.mark.quick_cases("collisions")
@pytest.mark.parametrize(("name", "actions", "steps", "made_with"), CASES)
def test_each_does_as_it_would_alone(name: str, actions: Any, steps: int, made_with: dict[str, Any]) -> None:
    """Observations, rewards, flags and infos, bit for bit, through the ends of episodes."""
    envs, singles = batch(name, **made_with), Singles(name, 3, **made_with)
    seen, infos = envs.reset(seed=4)
    alone, told = singles.reset(4)
    ends = np.zeros(2, int)
    for action in (None, *actions(envs, steps)):
        if action is not None:
            seen, rewards, ended, cut, infos = envs.step(action)
            results = singles.step(action)
            alone, told = [one[0] for one in results], [one[4] for one in results]
            assert [rewards.tolist(), ended.tolist(), cut.tolist()] == [[one[k] for one in results] for k in (1, 2, 3)]
            ends += ended.sum(), cut.sum()
        for robot in range(3):
            mine = {key: part[robot] for key, part in seen.items()}
            assert data_equivalence(mine, alone[robot], exact=True)
            assert same(infos, told[robot], robot)
    if actions is backward:
        assert ends[0] >= 3
    if "max_episode_steps" in made_with:
        assert ends[1] >= 3
    envs.close()


def test_after_an_end_the_next_episode_begins_in_a_step_that_does_nothing() -> None:
    envs = batch(TWIST, 2, max_episode_steps=2)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    ahead = np.array([[0.5, 0.0]] * 2, np.float32)
    _, first = envs.reset(seed=[5, 6])
    rows = [envs.step(ahead) for _ in range(4)]
    assert [row[3].tolist() for row in rows] == [[False] * 2, [True] * 2, [False] * 2, [False] * 2]
    *_, begun = rows[2]
    assert rows[2][1].tolist() == [0.0, 0.0]
    assert begun["action"].tolist() == ["", ""]
    assert begun["time"].tolist() == first["time"].tolist()
    assert not np.array_equal(begun["pose"], first["pose"])
    assert (rows[3][1] > 0).all()


def test_a_reset_in_between_begins_all_anew() -> None:
    envs = batch(TWIST, 2, max_episode_steps=3)
    ahead = np.array([[0.5, 0.0]] * 2, np.float32)
    first = envs.reset(seed=3)
    for _ in range(3):
        *_, cut, _ = envs.step(ahead)
    assert cut.all()
    assert data_equivalence(envs.reset(seed=3), first, exact=True)
    assert not envs.step(ahead)[3].any()
    assert not data_equivalence(envs.reset(), first, exact=True)


@pytest.mark.parametrize("name", refseq_bench.sim.envs.IDS[:4])
def test_what_is_given_is_as_gymnasium_asks(name: str) -> None:
    made_with: dict[str, Any] = {"world": CORRIDORS} if "Corridor" in name else {}
    envs, single = batch(name, 2, **made_with), gym.make(name, **made_with)
    assert envs.num_envs == 2
    assert envs.single_observation_space == single.observation_space
    assert envs.single_action_space == single.action_space
    assert envs.observation_space == batch_space(single.observation_space, 2)
    assert envs.action_space == batch_space(single.action_space, 2)
    seen, infos = envs.reset(seed=1)
    assert seen in envs.observation_space
    envs.action_space.seed(2)
    kept = {key: part.copy() for key, part in seen.items()}
    after, rewards, ended, cut, infos = envs.step(envs.action_space.sample())
    assert after in envs.observation_space
    assert [(part.shape, part.dtype.kind) for part in (rewards, ended, cut)] == [((2,), "f"), ((2,), "b"), ((2,), "b")]
    assert infos["pose"].shape == (2, 3)
    assert infos["time"].dtype == np.float64
    assert data_equivalence(seen, kept, exact=True)  # the next step writes nothing into what was given


def test_it_is_made_from_what_its_spec_says_as_json() -> None:
    """The limit of steps is that of the id, and the first choice of ``make_vec`` is the batch."""
    envs = gym.make_vec("refseq/CrossDoor-v0", num_envs=2)
    assert isinstance(envs.unwrapped, BatchEnv)
    assert envs.unwrapped._longest == 60
    assert envs.spec is not None
    text = envs.spec.to_json()
    assert json.loads(text)["vector_entry_point"] == "refseq_bench.sim.envs.batch:BatchEnv"
    again = gym.make_vec(EnvSpec.from_json(text))
    assert again.num_envs == 2
    assert data_equivalence(again.reset(seed=8), envs.reset(seed=8), exact=True)


def test_statistics_of_episodes_are_counted() -> None:
    envs = RecordEpisodeStatistics(batch(TWIST, 2, max_episode_steps=4))
    envs.reset(seed=0)
    total = np.zeros(2)
    for _ in range(4):
        _, rewards, _, _, infos = envs.step(np.full((2, 2), 0.3, np.float32))
        total += rewards
    assert infos["episode"]["l"].tolist() == [4, 4]
    assert infos["episode"]["r"].tolist() == pytest.approx(total.tolist())


def test_robots_in_one_world_are_stepped_in_one_call() -> None:
    envs = batch("refseq/FollowCorridorTwist-v0", 3, world="corridor:3")
    envs.reset(seed=0)
    envs.step(np.full((3, 2), 0.3, np.float32))
    assert envs._together.groups == [(0, 1, 2)]


@pytest.mark.parametrize(
    ("made_with", "message"),
    [
        ({"num_envs": 0}, "num_envs = 0 is not valid; valid are whole numbers from 1 on"),
        ({"num_envs": 1.5}, r"num_envs = 1\.5 is not valid; valid are whole numbers from 1 on"),
        ({"threads": -1}, "threads = -1 is not valid; valid are whole numbers from 0 on"),
        ({"threads": "x"}, "threads = 'x' is not valid; valid are whole numbers from 0 on"),
        ({"light": "moonshine"}, "moonshine"),
    ],
)
def test_what_it_cannot_be_made_with_is_told(made_with: dict[str, Any], message: str) -> None:
    with pytest.raises(SimError, match=message):
        BatchEnv(**made_with, task="cross-door", world="rooms:0")


def test_seeds_actions_and_options_that_do_not_fit_are_told() -> None:
    envs = batch(TWIST, 2)
    with pytest.raises(SimError, match="no episode has begun"):
        envs.step(np.zeros((2, 2), np.float32))
    with pytest.raises(SimError, match="3 seeds are not valid for 2 robots; valid is one for each"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(SimError, match="options 'pose' are unknown"):
        envs.reset(options={"pose": 1})
    envs.reset(seed=1)
    with pytest.raises(SimError, match="3 actions are not valid for 2 robots; valid is one for each"):
        envs.step(np.zeros((3, 2), np.float32))
    with pytest.raises(SimError, match="is not valid; valid are two finite numbers"):
        envs.step(np.array([[0.5, 0.0], [np.nan, 0.0]], np.float32))


def test_a_batch_that_is_closed_gives_all_its_robots_back() -> None:
    envs = batch(TWIST, 3)
    envs.reset(seed=1)
    envs.close()
    for one in envs.envs:
        with pytest.raises(SimError, match="no episode has begun, or it was closed: call reset first"):
            one.step(np.zeros(2, np.float32))


def test_nobody_moves_where_one_action_is_none() -> None:
    envs, action = batch(TWIST, 2), np.full((2, 2), 0.4, np.float32)
    envs.reset(seed=1)
    first = envs.step(action)
    envs.reset(seed=1)
    with pytest.raises(SimError, match="is not valid"):
        envs.step(np.array([[0.5, 0.0], [np.nan, 0.0]], np.float32))
    assert data_equivalence(envs.step(action), first, exact=True)
