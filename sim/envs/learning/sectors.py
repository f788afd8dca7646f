"""Observations in fewer numbers, none much larger than 1: what a small network learns from in minutes."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from refseq_bench.sim.envs.episodes.observations import FASTEST, Arrays
from refseq_bench.sim.sensors.beams import BEAMS

SECTORS = 36
"""The half circle before the robot in so many sectors; a choice."""
LASER_REACH, SONAR_REACH = 8.0, 3.0
"""Ranges beyond count as so far [m]; choices: the laser's nearer mode, and what sonars hear in a corridor."""
_BEGINS = np.arange(SECTORS) * BEAMS // SECTORS


class Sectors(gym.ObservationWrapper[Arrays, Any, Arrays], RecordConstructorArgs):
    """Keeps of what is observed the part that driving needs; it looks at nothing else, and at no truth.

    ``scan`` (36,) becomes the nearest range of each sector, from the right to the left, as a share of ``LASER_REACH``;
    ``sonar`` its ranges as shares of ``SONAR_REACH``; ``odometry`` (2,) the speed [m/s] and the turn rate [rad/s];
    ``asked`` has its ways as shares of ``LASER_REACH``, too. Everything else stays as it is.
    """

    def __init__(self, env: gym.Env[Arrays, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gym.ObservationWrapper.__init__(self, env)
        given = env.observation_space
        assert isinstance(given, spaces.Dict)
        parts: dict[str, spaces.Space[Any]] = {
            "scan": spaces.Box(0.0, 1.0, (SECTORS,), np.float32),
            "odometry": spaces.Box(-FASTEST[:2], FASTEST[:2], dtype=np.float32),
        }
        if "sonar" in given.spaces:
            parts["sonar"] = spaces.Box(0.0, 1.0, given["sonar"].shape, np.float32)
        if "asked" in given.spaces:
            parts["asked"] = spaces.Box(-1.0, 1.0, given["asked"].shape, np.float32)
        self.observation_space: spaces.Space[Arrays] = spaces.Dict({**given.spaces, **parts})

    def observation(self, observation: Arrays) -> Arrays:
        """The same, in fewer numbers."""
        fewer = observation | {
            "scan": shares(np.minimum.reduceat(observation["scan"], _BEGINS), LASER_REACH),
            "odometry": observation["odometry"][:2],
        }
        if "sonar" in fewer:
            fewer["sonar"] = shares(fewer["sonar"], SONAR_REACH)
        if "asked" in fewer:
            ways, behaviours = np.split(fewer["asked"], [1], axis=1)
            fewer["asked"] = np.hstack([np.clip(ways / np.float32(LASER_REACH), -1.0, 1.0), behaviours])
        return fewer


def shares(ranges: Any, reach: float) -> Any:
    """Ranges [m] as shares of ``reach`` [m], float32, at most 1."""
    return np.minimum(ranges / np.float32(reach), np.float32(1.0))
