"""Configuration of a training: what is tried was not learnt from."""

import pytest

from refseq_bench.sim.envs.learning.training_config import FIRST_TRIED, HELD_OUT, TrainingConfig
from refseq_bench.sim.errors import SimError


@pytest.mark.parametrize(("robots", "taught"), [(4, 50), (4, 2), (1, 0)])
def test_no_episode_is_both_learnt_from_and_tried(robots: int, taught: int) -> None:
    most = FIRST_TRIED - max(robots, taught)
    assert TrainingConfig("Mission", seed=most, robots=robots, taught=taught).seed == most
    with pytest.raises(
        SimError, match=f"^seed = {most + 1}, .*: episodes from seed 1000000 on are tried; valid is seed"
    ):
        TrainingConfig("Mission", seed=most + 1, robots=robots, taught=taught)


def test_what_is_learnt_in_corridors_is_tried_in_those_that_are_held_out() -> None:
    for worlds in ((), ("corridor:20",), ("corridor:1", "corridor:99")):
        config = TrainingConfig("FollowCorridor", worlds=worlds)
        assert (config.tried_in, config.tried_elsewhere) == (HELD_OUT, True)


@pytest.mark.parametrize("world", ["hallway", "corridor:3,width=2"])
def test_what_is_learnt_elsewhere_is_tried_there_and_says_so(world: str) -> None:
    config = TrainingConfig("FollowCorridor", worlds=(world,))
    assert (config.tried_in, config.tried_elsewhere) == ((world,), False)
    assert TrainingConfig("FollowCorridor", worlds=(world,), held_out=("corridor:3",)).tried_elsewhere


@pytest.mark.parametrize(
    ("worlds", "held_out", "both"),
    [
        (("corridor:3",), ("corridor:3",), "corridor:3"),
        (("corridor:3", "corridor:4"), ("corridor:5", "corridor:4"), "corridor:4"),
        ((), ("corridor:7", "corridor:15"), "corridor:7, corridor:15"),
        (("corridor:103",), (), "corridor:103"),
    ],
)
def test_no_world_is_both_learnt_in_and_held_out(worlds: tuple[str, ...], held_out: tuple[str, ...], both: str) -> None:
    with pytest.raises(SimError, match=f"^worlds {both}: are learnt in, and would be tried in; valid are others"):
        TrainingConfig("FollowCorridor", worlds=worlds, held_out=held_out)
