"""SICK LMS 200 in the range of 80 m, half-degree steps: ranges by ray casting, then what the device does to them.

The sources of its figures are in ``docs/robots.md``. Not in here yet: the two interlaced one-degree turns of the
half-degree mode (all beams leave at the same instant), mixed pixels at edges, remission (glass and matt black).
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan
from sim.errors import SimError

SEEN_GROUPS = np.array([1, 1, 0, 1, 0, 0], np.uint8)
"""Geom groups that stop a beam: not 2 (only seen by cameras), 4 and 5 (markers, inner masses)."""


@dataclass(frozen=True, slots=True)
class LaserModel:
    """Figures of a scanner; raises ``SimError`` for values that none could have.

    ``beams`` from ``start`` [rad], ``step`` [rad] apart, counter-clockwise. Ranges beyond ``max_range`` [m] come back
    as infinite (the device's codes from 8183 on); what is nearer than ``min_range`` [m] is reported at it (choice: the
    device is known to see down to there, and free space would be a dangerous answer). Ranges are multiples of
    ``resolution`` [m], with normal noise of ``sigma`` [m] and a bias of the device within ± ``bias_limit`` [m].
    """

    beams: int = 361
    start: float = -np.pi / 2
    step: float = np.pi / 360
    min_range: float = 0.14
    max_range: float = 80.0
    resolution: float = 0.01
    sigma: float = 0.005
    bias_limit: float = 0.015

    def __post_init__(self) -> None:
        if self.beams < 1:
            raise SimError(f"laser: beams = {self.beams}: at least 1 is needed")
        if not 0 <= self.min_range < self.max_range:
            raise SimError(f"laser: min_range = {self.min_range} m must be in [0, max_range = {self.max_range} m)")
        for key in ("resolution", "sigma", "bias_limit"):
            if getattr(self, key) < 0:
                raise SimError(f"laser: {key} = {getattr(self, key)} m must not be negative")

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit vectors of the beams in the scanner's frame, (beams, 3)."""
        bearings = self.start + self.step * np.arange(self.beams)
        return np.stack([np.cos(bearings), np.sin(bearings), np.zeros(self.beams)], axis=1)


class Laser:
    """One device: a model with the bias that this one left the factory with, drawn from ``rng`` as its noise is."""

    def __init__(self, model: LaserModel, rng: np.random.Generator) -> None:
        self.model = model
        self.bias = float(rng.uniform(-model.bias_limit, model.bias_limit))
        self._rng = rng
        self._directions = model.directions
        self._hit = np.empty(model.beams, np.int32)
        self._distance = np.empty(model.beams)

    def scan(self, mj_model: mujoco.MjModel, mj_data: mujoco.MjData, site: str, exclude_body: str) -> Scan:
        """Measure from ``site``, blind for the geoms of ``exclude_body``: the one that carries the scanner."""
        return Scan(
            ranges=self._measured(self.distances(mj_model, mj_data, site, exclude_body)),
            start=self.model.start,
            step=self.model.step,
            max_range=self.model.max_range,
        )

    def distances(
        self, mj_model: mujoco.MjModel, mj_data: mujoco.MjData, site: str, exclude_body: str
    ) -> NDArray[np.float64]:
        """Cast the beams: true distances along the beams, (beams,) [m]; infinite where nothing is within reach."""
        frame = mj_data.site(site)
        rays = self._directions @ frame.xmat.reshape(3, 3).T  # (beams, 3) in the world's frame
        mujoco.mj_multiRay(
            mj_model,
            mj_data,
            frame.xpos,
            rays.ravel(),
            SEEN_GROUPS,
            True,
            mj_model.body(exclude_body).id,
            self._hit,
            self._distance,
            None,
            self.model.beams,
            self.model.max_range + 1.0,
        )
        return np.where(self._hit >= 0, self._distance, np.inf)

    def _measured(self, distances: NDArray[np.float64]) -> NDArray[np.float32]:
        """Turn distances into what the device says: bias, noise, resolution and limits."""
        model = self.model
        # Noise is drawn for every beam, hit or not, so that the stream of numbers does not depend on the scene.
        noisy = distances + self.bias + self._rng.normal(0.0, model.sigma, model.beams)
        ranges = np.maximum(_rounded(noisy, model.resolution), model.min_range)
        return np.where(ranges > model.max_range, np.inf, ranges).astype(np.float32)


def _rounded(values: NDArray[np.float64], resolution: float) -> NDArray[np.float64]:
    """Return the nearest multiples of ``resolution``; the values themselves when it is 0."""
    return np.round(values / resolution) * resolution if resolution > 0 else values
