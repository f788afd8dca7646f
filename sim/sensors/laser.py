"""SICK LMS 200 in half-degree steps: light that comes back, then what the device makes of it, as words and as ranges.

Sources of its figures are in ``docs/sim.md``.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan
from refseq_bench.sim.sensors.arcs import in_arc
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
from refseq_bench.sim.sensors.laser_model import ABOVE_MAX, DAZZLE, LOW_SNR, LaserModel, RangeMode
from refseq_bench.sim.sensors.ray_scene import RayScene


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
