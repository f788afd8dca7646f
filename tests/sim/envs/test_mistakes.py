"""Mistakes of those who make an environment and step it, each told in one line."""

import gymnasium
import numpy as np
import pytest

import refseq_bench.sim.envs
from refseq_bench.sim.envs.robot_env import _route_in
from refseq_bench.sim.envs.tasks.by_name import made_task
from refseq_bench.sim.errors import SimError

assert refseq_bench.sim.envs

ID = "refseq/FollowCorridorTwist-v0"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            {"wrold": "hallway"},
            r"unknown keyword 'wrold' of FollowCorridorTask: valid are world, route, actions, robot",
        ),
        ({"cameras": "camera-1"}, r"cameras 'camera-1' is not valid; valid is a list of names, as \['camera-1'\]"),
        ({"cameras": 3}, r"cameras 3 is not valid; valid is a list of names, as \['camera-1'\]"),
        ({"route": ["forward"]}, r"unknown route \['forward'\] in world 'corridor:0': valid are forward, reverse"),
        ({"pixels": 84}, "pixels 84 without cameras is not valid"),
        ({"world": "/nowhere/plan.toml"}, r"/nowhere/plan\.toml: cannot be read: No such file or directory$"),
        ({"world": "halway"}, r"unknown world 'halway'.*, or rooms:FORM"),
        ({"world": 3}, "world = 3 is not valid: valid is a name, a floor plan's file, or several"),
        ({"light": None}, "light = None is not valid: valid is a name or an hour, such as '16:00'"),
        ({"light": 18}, "light = 18 is not valid: valid is a name or an hour, such as '16:00'"),
    ],
)
def test_what_is_asked_for_wrongly_is_told_with_what_is_valid(asked: dict[str, object], message: str) -> None:
    with pytest.raises(SimError, match=message) as told:
        gymnasium.make(ID, **asked)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("name", "world", "route"),
    [
        ("ReachPlace", "laboratory", "round"),
        ("Recover", "laboratory", "round"),
        ("Recover", "hallway", "forward"),
        ("Mission", "offices", "forward"),
    ],
)
def test_a_task_without_a_route_takes_its_own_or_the_first_of_the_world(name: str, world: str, route: str) -> None:
    made_with = gymnasium.spec(f"refseq/{name}-v0").kwargs
    assert _route_in(world, made_with.get("route"), made_task(made_with["task"], {})) == route


def test_an_episode_that_is_over_takes_no_step() -> None:
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=1)
    over = False
    for _ in range(400):  # straight ahead it meets a wall
        _, _, over, _, _ = env.step(np.array([1.0, 0.3]))
        if over:
            break
    assert over
    with pytest.raises(SimError, match="the episode is over: call reset first"):
        env.step(np.zeros(2))
    env.reset(seed=2)
    env.step(np.zeros(2))
    env.close()


@pytest.mark.parametrize("action", ["x", [1.0], [np.nan, 0.0], None])
def test_a_twist_that_is_none_is_told(action: object) -> None:
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=1)
    with pytest.raises(SimError, match=r"action .* is not valid; valid are two finite numbers from -1 to 1"):
        env.step(action)
    env.close()
