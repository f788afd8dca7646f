"""A ring of Polaroid rangers: which of them fire when, and what a reading makes of an echo.

Figures of CARMEN's sensor model (facts): readings spread by 5 cm; one in a hundred hears nothing, one in two hundred
is any length. The nearest range is that of the ranger's common electronics (6 inches, common knowledge).
"""

import math
from dataclasses import dataclass
from numbers import Integral

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.ray_scene import RayScene
from refseq_bench.sim.sensors.ultrasound import UltrasoundRangers

SOUND = 343.0
"""Speed of sound at 20 °C [m/s]."""


@dataclass(frozen=True, slots=True)
class SonarModel:
    """Figures of the rangers; raises ``SimError`` for values that none could have.

    Ranges are within ``min_range`` and ``max_range`` [m]: what is nearer is reported at the first, no echo at the last.
    Noise is normal, of ``sigma`` [m]; ``lost`` and ``random`` are the shares of readings that are ``max_range`` or any.
    Rangers fire in ``groups``, one group after the other: number i in group i modulo ``groups``. Six (a choice) of the
    Robuter's 24 put one of each side into a group, so that none fires beside another. With ``cross_talk`` a ranger
    hears the echoes of those too that fire with it.
    """

    min_range: float = 0.15
    max_range: float = 10.668
    sigma: float = 0.05
    lost: float = 0.01
    random: float = 0.005
    groups: int = 6
    cross_talk: bool = False

    def __post_init__(self) -> None:
        if not (0 <= self.min_range < self.max_range < math.inf):
            raise SimError(f"sonar: min_range = {self.min_range} m must be in [0, max_range = {self.max_range} m)")
        if not 0 <= self.sigma < math.inf:
            raise SimError(f"sonar: sigma = {self.sigma} m must be 0 or more, and finite")
        if not (self.lost >= 0 and self.random >= 0 and self.lost + self.random <= 1):
            raise SimError(f"sonar: lost = {self.lost} and random = {self.random} must be shares of at most 1 together")
        if not (isinstance(self.groups, Integral) and self.groups >= 1):
            raise SimError(f"sonar: groups = {self.groups} must be a whole number, 1 or more")

    @property
    def listening(self) -> float:
        """Time from one group's firing to the next one's [s]: sound's way to the farthest range and back."""
        return 2 * self.max_range / SOUND

    @property
    def period(self) -> float:
        """Time in which all rangers fire once [s]."""
        return self.groups * self.listening


class SonarRing:
    """The rangers of one robot, at ``sites`` of ``model``, deaf to the body ``base`` that carries them.

    Others that cast rays in the model may share a ``scene`` with them.

    By time 0 all of them have fired; then the groups take turns.
    """

    def __init__(
        self,
        sonar: SonarModel,
        rng: np.random.Generator,
        model: mujoco.MjModel,
        sites: tuple[str, ...],
        base: str,
        scene: RayScene | None = None,
    ) -> None:
        self.model, self._rng = sonar, rng
        self._ears = UltrasoundRangers(scene or RayScene(model), sites, base, sonar.max_range)
        self._groups = [np.arange(first, len(sites), sonar.groups) for first in range(sonar.groups)]
        self._fired = -sonar.groups
        self._readings = np.full(len(sites), sonar.max_range)

    def read(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """The newest readings, (n,) [m], read-only; those that are due fire now."""
        due = math.floor(data.time / self.model.listening + 1e-9)
        if due < self._fired:  # somebody set the clock back
            self._fired = due - self.model.groups
        # After a long pause no ranger fires twice at one moment.
        firings = range(max(self._fired + 1, due - self.model.groups + 1), due + 1)
        if firings:
            self._fired = due
            self._fire(data, [self._groups[number % self.model.groups] for number in firings])
        return self._readings

    def _fire(self, data: mujoco.MjData, groups: list[NDArray[np.intp]]) -> None:
        readings = self._readings.copy()
        for group in filter(len, groups):  # of more groups than rangers some are empty
            readings[group] = self._reported(self.distances(data, group))
        readings.setflags(write=False)
        self._readings = readings

    def distances(self, data: mujoco.MjData, group: NDArray[np.intp]) -> NDArray[np.float64]:
        """Half the way of the first sound that comes back to each ranger of ``group`` [m]."""
        ways = self._ears.echoes(data, group)
        own = np.sqrt((ways * ways).sum(axis=1))
        if not self.model.cross_talk:
            return own
        speaking = np.isfinite(own)
        back = self._ears.between(data, group, np.where(speaking[:, None], ways, 0.0))
        overheard = (own[:, None] + back) / 2  # (speakers, listeners), infinite where nothing comes back
        return np.minimum(own, overheard.min(axis=0))

    def _reported(self, distances: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn distances into readings with noise and failures."""
        model, count = self.model, len(distances)
        # All are drawn for every reading, echo or not, so that the stream of numbers does not depend on the scene.
        noise, chance = self._rng.standard_normal(count), self._rng.random(count)
        any_length = self._rng.uniform(model.min_range, model.max_range, count)
        readings = np.clip(distances + model.sigma * noise, model.min_range, model.max_range)
        readings[chance < model.lost + model.random] = any_length[chance < model.lost + model.random]
        readings[chance < model.lost] = model.max_range
        return readings
