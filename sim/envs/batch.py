"""Environments in a batch: several robots, each in a world of its own, whose physics are stepped together.

Everything else (electronics, sensors, behaviours, tasks) is each robot's own, the same code as in ``RobotEnv``.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array, iterate
from numpy.typing import NDArray

from refseq_bench.sim.envs.episodes.observations import Arrays
from refseq_bench.sim.envs.robot_env import HUMAN, RobotEnv, Stepped
from refseq_bench.sim.envs.vector import PhysicsBatch
from refseq_bench.sim.errors import SimError

Flags = NDArray[np.bool_]


class BatchEnv(VectorEnv[Arrays, Any, NDArray[Any]]):
    """``num_envs`` robots that do what as many ``RobotEnv`` of the same keywords would do, bit for bit.

    ``gym.make_vec("refseq/FollowCorridor-v0", num_envs=8, vectorization_mode="vector_entry_point")`` makes one. As
    Gymnasium's own vectors do, it gives robot i the seed + i, begins the next episode in the step after the last one
    has ended (``AutoresetMode.NEXT_STEP``: that step's action counts nothing, its reward is 0), and cuts episodes off
    after ``max_episode_steps``, if any. Physics are stepped on so many ``threads``, 0 for one a core: nothing that
    happens depends on it. Raises ``SimError`` as ``RobotEnv`` does.
    """

    def __init__(
        self, num_envs: int = 1, *, max_episode_steps: int | None = None, threads: int = 0, **made_with: Any
    ) -> None:
        for name, value, least in (("num_envs", num_envs, 1), ("threads", threads, 0)):
            if not isinstance(value, int | np.integer) or value < least:
                raise SimError(f"{name} = {value!r:.60} is not valid; valid are whole numbers from {least} on")
        if made_with.get("render_mode") == HUMAN:
            raise SimError("render mode 'human' is not valid for a batch of robots; valid is 'rgb_array', or gym.make")
        self.num_envs, self._longest = num_envs, max_episode_steps
        self.envs = tuple(RobotEnv(**made_with) for _ in range(num_envs))
        first = self.envs[0]
        self.metadata = first.metadata | {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.render_mode = first.render_mode
        self.single_action_space, self.single_observation_space = first.action_space, first.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._together = PhysicsBatch(threads)
        self._lengths = np.zeros(num_envs, int)
        self._over: Flags = np.zeros(num_envs, bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Set all robots down for new episodes; ``seed`` is that of the first, or one for each; ``options`` none."""
        begun = [env.reset(seed=one, options=options) for env, one in zip(self.envs, self._seeds(seed), strict=True)]
        self._lengths[:], self._over[:] = 0, False
        return self._batched([observation for observation, _ in begun]), self._told([info for _, info in begun])

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + number for number in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise SimError(f"{len(seed)} seeds are not valid for {self.num_envs} robots; valid is one for each")
        return seed

    def step(self, actions: Any) -> tuple[Arrays, NDArray[np.float64], Flags, Flags, dict[str, Any]]:
        """Let all robots do something for a while; each step lasts for all as long as for the slowest.

        A robot whose action has ended waits, as its time does not go on.
        """
        given = list(iterate(self.action_space, actions))
        if len(given) != self.num_envs:
            raise SimError(f"{len(given)} actions are not valid for {self.num_envs} robots; valid is one for each")
        anew = np.flatnonzero(self._over).tolist()
        runs = {i: env.stepping(given[i]) for i, env in enumerate(self.envs) if i not in anew}
        done = self._together.run(runs) | {i: _begun(self.envs[i]) for i in anew}
        observations, rewards, ended, _, infos = zip(*(done[i] for i in range(self.num_envs)), strict=True)
        self._lengths = np.where(self._over, 0, self._lengths + 1)
        terminated, truncated = np.array(ended, bool), np.zeros(self.num_envs, bool)
        if self._longest is not None:
            truncated = self._lengths >= self._longest
        self._over = terminated | truncated
        return self._batched(observations), np.array(rewards, np.float64), terminated, truncated, self._told(infos)

    def _batched(self, observations: Sequence[Arrays]) -> Arrays:
        space = self.single_observation_space
        batched = create_empty_array(space, self.num_envs)
        assert isinstance(batched, dict), "observations are of a Dict space"
        concatenate(space, observations, batched)
        return batched

    def _told(self, infos: Sequence[dict[str, Any]]) -> dict[str, Any]:
        told: dict[str, Any] = {}
        for number, info in enumerate(infos):
            told = self._add_info(told, info, number)
        return told

    def render(self) -> tuple[Any, ...]:
        """A picture of each robot, see ``RobotEnv.render``."""
        return tuple(env.render() for env in self.envs)

    def close_extras(self, **kwargs: Any) -> None:
        """Give the renderers' devices back."""
        for env in self.envs:
            env.close()


def _begun(env: RobotEnv) -> Stepped:
    observation, info = env.reset()
    return observation, 0.0, False, False, info
