"""The executor plays missions in the environment, by what the robot itself knows."""

from typing import cast

import gymnasium as gym
import numpy as np
import pytest

import refseq_bench.sim.envs  # noqa: F401 - registers the ids
from refseq.map.paths.annotations import DoorSide, PathDoor
from refseq.missions import Status
from refseq.missions.language import parse_mission
from refseq.missions.plan import compiled
from refseq_bench.sim.envs.learning.executor_policy import ExecutorPolicy
from refseq_bench.sim.envs.learning.imitation import examples
from refseq_bench.sim.envs.learning.sectors import Sectors
from refseq_bench.sim.envs.learning.training_config import TrainingConfig, environment
from refseq_bench.sim.envs.robot_env import RobotEnv
from refseq_bench.sim.envs.tasks.task import SUCCESS
from refseq_bench.sim.errors import SimError
from tests.refseq.missions.on_a_line import seen_at, way


def unwrapped(env: gym.Env) -> RobotEnv:  # type: ignore[type-arg]
    inner = env.unwrapped
    assert isinstance(inner, RobotEnv)
    return inner


def played(env: gym.Env, seed: int) -> tuple[float, ExecutorPolicy, dict[str, object]]:  # type: ignore[type-arg]
    """Return of the executor's episode, the executor, and the last info with the way at the start."""
    seen, info = env.reset(seed=seed)
    policy, way = ExecutorPolicy(unwrapped(env)), info["distance_to_goal"]
    total, over = 0.0, False
    while not over:
        seen, reward, ended, cut, info = env.step(policy(seen, info))
        total, over = total + float(reward), ended or cut
    return total, policy, info | {"way": way}


STAND = 0
slow = pytest.mark.slow


MISSIONS = ["[LD]", pytest.param("[LI5MT270]", marks=slow), pytest.param("[LD_LDMC]", marks=slow)]


@pytest.mark.slow
@pytest.mark.parametrize("mission", MISSIONS)
def test_the_executor_carries_missions_out_and_is_paid_for_the_way(mission: str) -> None:
    env = gym.make("refseq/Mission-v0", mission=mission)
    total, policy, info = played(env, 3)
    assert (info["success"], info["wrong_switches"], info["mission"]) == (True, 0, mission)
    assert total == pytest.approx(info["way"] - info["distance_to_goal"] + SUCCESS)  # type: ignore[operator]
    assert policy.executor.status in (Status.COMPLETED, Status.MANOEUVRING)


@slow
def test_a_wrapper_that_changes_what_is_seen_changes_nothing_for_it() -> None:
    plain, fewer = (
        played(wrap(gym.make("refseq/Mission-v0", mission="[LD]")), 4) for wrap in (lambda env: env, Sectors)
    )
    assert plain[0] == fewer[0]
    assert [str(entry) for entry in plain[1].executor.log] == [str(entry) for entry in fewer[1].executor.log]


@slow
def test_examples_are_what_the_executor_saw_and_did() -> None:
    """Played again, its actions lead through the same observations to the missions' ends."""
    config = TrainingConfig("Mission", seed=2, steps=0, taught=2)
    observations, actions = examples(config)
    env, ended, n = environment(config.task, config.learnt_in), False, 0
    for number in range(config.taught):
        seen, info = env.reset(seed=config.seed + number)
        ended = False
        while not ended:
            assert all(np.array_equal(seen[key], observations[n][key]) for key in seen)
            seen, _, over, cut, info = env.step(actions[n])
            ended, n = over or cut, n + 1
        assert info["success"]
    assert n == len(actions) == len(observations)
    env.close()


@slow
def test_it_carries_out_most_missions_that_are_drawn() -> None:
    env = gym.make("refseq/Mission-v0")
    assert sum(bool(played(env, seed)[2]["success"]) for seed in range(12)) >= 10


class Striding:
    """Stands for an environment whose robot goes half a metre in a step, or stands; its localiser always knows."""

    chooses_behaviours = True

    def __init__(self, door: float) -> None:
        self._way = way(20.0, doors=[PathDoor(door, DoorSide.LEFT, 0.9, passable=False)])
        self.plan = compiled(parse_mission("[LD]"), self._way)
        self.x = 0.0
        self.step(STAND)

    def number_of(self, behaviour: str) -> int:
        return STAND if behaviour == "stop" else STAND + 1

    def step(self, action: int) -> None:
        ahead = 0.0 if action == STAND else 0.5
        self.x += ahead
        self.motion, self.belief = (ahead, 0.0, 0.0), seen_at(self._way.along, self.x)


@pytest.mark.parametrize("door", np.linspace(5.02, 5.48, 6))
def test_it_stops_after_the_step_whose_end_is_nearest_to_the_place(door: float) -> None:
    robot = Striding(door)
    policy = ExecutorPolicy(cast(RobotEnv, robot))
    for time in range(30):
        robot.step(policy(None, {"time": float(time), "outcome": "running", "why": ""}))
    assert policy.executor.status is Status.COMPLETED
    assert abs(robot.x - door) <= 0.25


def test_it_plays_missions_with_behaviours_only() -> None:
    for name in ("refseq/CrossDoor-v0", "refseq/MissionTwist-v0"):
        env = gym.make(name)
        env.reset(seed=0)
        with pytest.raises(SimError, match="the executor needs a mission and behaviours as actions"):
            ExecutorPolicy(unwrapped(env))
