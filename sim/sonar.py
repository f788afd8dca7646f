"""A ring of ultrasonic rangers."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SonarModel:
    """A ranger's figures: ``max_range`` [m]."""

    max_range: float = 10.668


class SonarRing:
    """All rangers of one robot."""

    def __init__(
        self, sonar: SonarModel, rng: np.random.Generator, model: mujoco.MjModel, sites: tuple[str, ...], base: str
    ) -> None:
        self._sonar, self._rng, self._model, self._sites, self._base = sonar, rng, model, sites, base

    def read(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """The newest readings, (n,) [m]."""
        return np.full(len(self._sites), self._sonar.max_range)
