"""SICK LMS 200 in half-degree steps: light that comes back, then what the device makes of it, as words and as ranges.

Sources of its figures are in ``docs/sim.md``.
"""

import math
from dataclasses import dataclass
from enum import Enum

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.beams import (
    BEAMS,
    GLASS_GROUPS,
    SEEN_GROUPS,
    START,
    STEP,
    Hits,
    bearings,
    cast,
    cones,
    directions,
    sweep,
)
from refseq_bench.sim.sensors.laser_echoes import THRESHOLD, LaserEchoes, first_echo, light_from, remissions
from refseq_bench.sim.sensors.ray_scene import RayScene

ABOVE_MAX, LOW_SNR, DAZZLE = 8183, 8187, 8190
"""Words that are no ranges: farther than can be said, or nothing there; too little light came back; too much did."""

ON_EDGE = 1e-9
"""A beam so little beside an arc [rad] is in it: it lies on its edge, but for rounding."""


class RangeMode(Enum):
    """Words of the device in a metre. Words go up to 8182, codes begin at 8183."""

    METRES_8 = 1000
    METRES_80 = 100

    @property
    def max_range(self) -> float:
        """The farthest range that a word can say [m]."""
        return (ABOVE_MAX - 1) / self.value


@dataclass(frozen=True, slots=True)
class LaserModel:
    """Figures of a device; raises ``SimError`` for values that none could have.

    What is nearer than ``min_range`` [m] is reported at it (choice: the device is known to see down to there, and free
    space would be a dangerous answer). Noise is normal, of ``sigma`` [m] and, for the weakest echo that is told from
    noise, ``weak_sigma`` [m] on top. Each device has a bias of its own within ± ``bias_limit`` [m].
    """

    mode: RangeMode = RangeMode.METRES_80
    min_range: float = 0.14
    sigma: float = 0.005
    weak_sigma: float = 0.01
    bias_limit: float = 0.015

    def __post_init__(self) -> None:
        farthest = self.mode.max_range
        if not 0 <= self.min_range < farthest:
            raise SimError(f"laser: min_range = {self.min_range} m must be in [0, {farthest:g} m)")
        for key in ("sigma", "weak_sigma", "bias_limit"):
            if not 0 <= getattr(self, key) < math.inf:
                raise SimError(f"laser: {key} = {getattr(self, key)} m must be 0 or more, and finite")


@dataclass(frozen=True, slots=True)
class Telegram:
    """A scan as the device sends it: ``words`` (361,) uint16 of 13 bits, read-only, counter-clockwise."""

    words: NDArray[np.uint16]
    mode: RangeMode

    @property
    def ranges(self) -> NDArray[np.float32]:
        """Ranges (361,) [m], infinite where the word is a code."""
        return np.where(self.words < ABOVE_MAX, self.words / self.mode.value, np.inf).astype(np.float32)


class Laser:
    """One device: a model with the bias that this one left the factory with, drawn from ``rng`` as its noise is.

    Others that cast rays in its world may share a ``scene`` with it.
    """

    def __init__(self, model: LaserModel, rng: np.random.Generator, scene: RayScene | None = None) -> None:
        self.model, self._scene = model, scene
        self.bias = float(rng.uniform(-model.bias_limit, model.bias_limit))
        self._rng = rng
        self.dazzled: tuple[tuple[float, float], ...] = ()
        """Arcs from which something shines into the device, each from a bearing counter-clockwise to the next [rad]."""

    def scan(self, mj_model: mujoco.MjModel, mj_data: mujoco.MjData, site: str, exclude_body: str) -> Scan:
        """Measure from ``site``, blind for the geoms of ``exclude_body``: the one that carries the scanner."""
        ranges = self.raw(mj_model, mj_data, site, exclude_body).ranges
        return Scan(ranges, START, STEP, self.model.mode.max_range)

    def raw(self, mj_model: mujoco.MjModel, mj_data: mujoco.MjData, site: str, exclude_body: str) -> Telegram:
        """Measure as ``scan`` does; the result as the device sends it."""
        return self.reading(self.echoes(mj_model, mj_data, site, exclude_body))

    def echoes(self, mj_model: mujoco.MjModel, mj_data: mujoco.MjData, site: str, exclude_body: str) -> LaserEchoes:
        """Return what comes back, before the device's errors; the scan ends at this moment."""
        looks = sweep(mj_model, mj_data, site)
        blind_body = mj_model.body(exclude_body).id
        reach = self.model.mode.max_range + 1.0
        if self._scene is None or self._scene.model is not mj_model:
            self._scene = RayScene(mj_model)
        scene = self._scene

        def meet(rays: NDArray[np.float64], groups: NDArray[np.uint8]) -> Hits:
            return cast(scene, mj_data, looks, rays, groups, blind_body, reach)

        middles = directions()[:, None]
        middle, glass = meet(middles, SEEN_GROUPS), meet(middles, GLASS_GROUPS)
        ring = meet(cones(middle.distance[:, 0])[:, 1:], SEEN_GROUPS)
        return first_echo(light_from(middle.beside(ring), glass, remissions(mj_model)))

    def reading(self, echoes: LaserEchoes) -> Telegram:
        """Turn echoes into words, with the device's bias, noise, steps, limits and codes."""
        model = self.model
        # Noise is drawn for every beam, hit or not, so that the stream of numbers does not depend on the scene.
        noise = self._rng.normal(size=BEAMS)
        weakness = THRESHOLD / np.maximum(echoes.power, THRESHOLD)
        ranges = echoes.distance + self.bias + np.hypot(model.sigma, model.weak_sigma * weakness) * noise
        counts = np.round(np.maximum(ranges, model.min_range) * model.mode.value)
        too_weak = np.isinf(echoes.distance) & (echoes.power > 0)
        words = np.where(too_weak, LOW_SNR, np.minimum(counts, ABOVE_MAX)).astype(np.uint16)
        for low, high in self.dazzled:
            words[in_arc(bearings(), low, high - low)] = DAZZLE
        words.setflags(write=False)
        return Telegram(words, model.mode)


def in_arc(beams: NDArray[np.float64], low: float, width: float) -> NDArray[np.bool_]:
    """Mask of bearings of ``beams`` (n,) from ``low`` counter-clockwise over ``width``, edges too [rad]; 2π is all."""
    inside: NDArray[np.bool_] = (beams - low + ON_EDGE) % (2 * np.pi) <= width + 2 * ON_EDGE
    return inside
