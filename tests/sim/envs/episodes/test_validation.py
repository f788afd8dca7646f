"""Mistakes in tasks of one's own, each told in one line when an episode begins or a step is judged."""

import math

import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench.sim.envs import Episode, RobotEnv, Situation, Task, TaskGround
from refseq_bench.sim.errors import SimError

RIGHT = Pose(2.0, 0.0, 0.0)
WORLD = "corridor:3"


class Given(Episode):
    """Begins where it is told; what remains is ``ways``, one after the other."""

    def __init__(self, start: object, ways: tuple[float, ...] = (1.0,)) -> None:
        self.start, self._ways = start, list(ways)  # type: ignore[assignment]

    def remaining(self, situation: Situation) -> float:
        return self._ways.pop(0)

    def reached(self, situation: Situation) -> bool:
        return False


class GivenTask(Task):
    """Has the episode that the class is given."""

    behaviours = ("MN:1000", "stop")
    given: object = None

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        return self.given  # type: ignore[return-value]


def env_of(given: object) -> RobotEnv:
    return RobotEnv(type("MyTask", (GivenTask,), {"given": given}), WORLD)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (None, r"^task MyTask: episode returned None; valid is an Episode$"),
        (
            Given((2.0, 0.0, 0.0)),
            r"^task MyTask: start \(2\.0, 0\.0, 0\.0\) is not valid; valid is a refseq\.planar\.Pose$",
        ),
        (
            Given(Pose(math.nan, 0.0, 0.0)),
            r"^task MyTask: start Pose\(x=nan, .* valid are finite numbers \[m, m, rad\]$",
        ),
        (
            Given(Pose(2.0, 500.0, 0.0)),
            r"no room for 'robuter' at any of 100 starts.*, the last at Pose\(x=2\.0, y=500\.0",
        ),
        (Given(RIGHT, (math.nan,)), r"^Given: remaining returned nan; valid is a finite number$"),
    ],
)
def test_an_episode_that_cannot_begin_is_told(given: object, message: str) -> None:
    with pytest.raises(SimError, match=message) as told:
        env_of(given).reset(seed=1)
    assert "\n" not in str(told.value)


def test_a_step_without_a_finite_distance_is_told() -> None:
    env = env_of(Given(RIGHT, (1.0, 0.5, math.inf)))
    env.reset(seed=1)
    assert env.step(1)[1] == 0.5
    with pytest.raises(SimError, match=r"^Given: remaining returned inf; valid is a finite number$"):
        env.step(1)
