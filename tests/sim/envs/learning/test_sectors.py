"""Observations in sectors against the rays that they are made of."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from refseq_bench.sim.envs.learning.sectors import LASER_REACH, SECTORS, SONAR_REACH, Sectors
from refseq_bench.sim.envs.learning.training_config import HELD_OUT, TrainingConfig, environment
from refseq_bench.sim.envs.registry import CORRIDORS
from refseq_bench.sim.errors import SimError

NAME = "refseq/CrossDoorTwist-v0"


def test_each_sector_is_the_nearest_of_its_rays() -> None:
    env = Sectors(gym.make(NAME))
    scan = np.full(361, 20.0, np.float32)
    scan[[3, 195, 360]] = 1.0, 2.0, 4.0
    whole = {"scan": scan, "sonar": np.linspace(0, 10, 24, dtype=np.float32), "stops": np.zeros(3, np.float32)}
    fewer = env.observation(whole | {"odometry": np.arange(5, dtype=np.float32)})
    near = {i: float(share) for i, share in enumerate(fewer["scan"]) if share < 1}
    assert near == {0: 1 / LASER_REACH, 19: 2 / LASER_REACH, SECTORS - 1: 4 / LASER_REACH}
    assert fewer["sonar"] == pytest.approx(np.minimum(whole["sonar"] / SONAR_REACH, 1))
    assert fewer["odometry"].tolist() == [0, 1]
    assert fewer["stops"] is whole["stops"]


def test_ways_to_what_a_mission_asks_are_shares_of_the_laser_s_reach_and_behaviours_stay() -> None:
    env = Sectors(gym.make(NAME))
    whole = {name: np.zeros(size, np.float32) for name, size in (("scan", 361), ("sonar", 24), ("odometry", 5))}
    asked = np.array([[-1.0, 0, 1], [5.0, 1, 0], [99.0, 0, 1], [0, 0, 0]], np.float32)
    found = env.observation(whole | {"asked": asked})["asked"]
    assert found[:, 0] == pytest.approx([-1 / LASER_REACH, 5 / LASER_REACH, 1.0, 0.0])
    np.testing.assert_array_equal(found[:, 1:], asked[:, 1:])


@pytest.mark.parametrize(("name", "robot"), [(NAME, "robuter"), (NAME, "segway_rmp")])
def test_what_is_seen_is_in_the_space_and_nothing_but_that_is_changed(name: str, robot: str) -> None:
    env, plain = Sectors(gym.make(name, robot=robot)), gym.make(name, robot=robot)
    (seen, info), (whole, told) = env.reset(seed=2), plain.reset(seed=2)
    assert seen in env.observation_space
    assert set(seen) == set(whole)
    assert info["time"] == told["time"]
    ahead = np.array([0.5, 0.0], np.float32)
    seen, reward, *_ = env.step(ahead)
    assert seen in env.observation_space
    assert reward == plain.step(ahead)[1]


def test_it_is_made_again_with_what_it_wraps() -> None:
    env = Sectors(gym.make(NAME))
    assert env.spec is not None
    assert gym.make(EnvSpec.from_json(env.spec.to_json())).observation_space == env.observation_space


def test_nobody_is_tried_where_they_learnt_to_follow_corridors() -> None:
    config = TrainingConfig("FollowCorridorTwist")
    assert config.learnt_in == tuple(CORRIDORS)
    assert config.tried_in == HELD_OUT
    assert not set(config.learnt_in) & set(HELD_OUT)
    assert TrainingConfig("ReachPlace").tried_in == ("laboratory",)
    assert TrainingConfig("FollowCorridor", held_out=("hallway",)).tried_in == ("hallway",)


def test_one_world_is_given_by_its_name() -> None:
    env = environment("FollowCorridor", ("corridor:3",))
    assert env.spec is not None
    assert env.spec.kwargs["world"] == "corridor:3"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"task": "Fly"}, "unknown task 'Fly': valid are FollowCorridor, "),
        ({"seconds": 0.0}, "seconds = 0.0 is not valid; valid are 1 or more"),
        ({"seconds": float("nan")}, "seconds = nan is not valid; valid are 1 or more"),
        ({"robots": 0}, "robots = 0 is not valid; valid are 1 or more"),
        (
            {"seed": 999_999},
            "seed = 999999, robots = 4: episodes from seed 1000000 on are tried; valid is seed . robots up to 1000000",
        ),
        ({"episodes": 1}, "episodes = 1 is not valid; valid are 2 or more"),
        ({"taught": 2}, "taught = 2 is not valid for FollowCorridor: the executor plays Mission alone"),
        ({"task": "Mission", "taught": -1}, "taught = -1 is not valid; valid are 0 or more"),
        ({"task": "Mission", "steps": 0}, "steps = 0 is not valid; valid are 1 or more"),
    ],
)
def test_configs_that_cannot_be_are_told(values: dict[str, object], message: str) -> None:
    with pytest.raises(SimError, match=message):
        TrainingConfig(**{"task": "FollowCorridor"} | values)  # type: ignore[arg-type]
