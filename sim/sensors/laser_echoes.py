"""Light that comes back to a LMS 200, and the echo that its receiver answers to.

Power is relative to what a white matt surface that is met squarely sends back from 1 m: the share of a beam that meets
a surface, times its remission, times the cosine of incidence (Lambert's law), over the square of the distance.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.sensors.beams import Hits

UNKNOWN_REMISSION = 0.4
"""Remission at 905 nm of a geom that does not state its own, as a share of white plaster's: that of wood."""
THRESHOLD = 0.1 / 30.0**2
"""Least power that is told from noise: a surface of 10 % is seen as far as 30 m."""
PULSE = 0.5
"""Echoes that follow within this distance [m] run into one: half the way of light in a pulse of 3.3 ns."""
DARK, DARK_SHIFT = 0.2, 0.01
"""Below the remission ``DARK`` a surface looks nearer, by ``DARK_SHIFT`` [m] for each factor of ten."""
PANE_TRANSMISSION = 0.8
PANE_REMISSION, PANE_LOBE = 2.0, np.radians(1.0)
"""Glass answers like glossy steel, but only to a beam within the lobe [rad] of its normal."""


@dataclass(frozen=True, slots=True)
class Light:
    """Light that comes back: from what ``distance`` [m] and its ``power``, both (beams, sources); 0 from nothing."""

    distance: NDArray[np.float64]
    power: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LaserEchoes:
    """Echoes that the receiver answers to, beam by beam.

    ``distance`` (beams,) [m] is infinite where too little light came back; ``power`` (beams,) is that of the echo, or
    all that came back where it was too little.
    """

    distance: NDArray[np.float64]
    power: NDArray[np.float64]


def remissions(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Remission of each geom, (ngeom,): its first user value, where that is positive."""
    stated = model.geom_user[:, 0] if model.nuser_geom else np.zeros(model.ngeom)
    return np.where(stated > 0, stated, UNKNOWN_REMISSION)


def light_from(solid: Hits, glass: Hits, remission: NDArray[np.float64]) -> Light:
    """Light back from solids, by rays of equal shares of a beam, and from the pane that its middle ray meets.

    ``solid`` is (beams, rays), ``glass`` (beams, 1), ``remission`` (ngeom,).
    """
    whiteness = remission[solid.geom]
    through_pane = glass.distance < solid.distance
    loss = np.where(through_pane, PANE_TRANSMISSION**2, 1.0)
    share = through_pane.mean(axis=1, keepdims=True)
    glint = np.where(glass.cosine >= np.cos(PANE_LOBE), PANE_REMISSION * share, 0.0)
    looks_at = solid.distance - DARK_SHIFT * np.maximum(np.log10(DARK / whiteness), 0.0)
    distance = np.hstack([looks_at, glass.distance])
    power = np.hstack([_returned(whiteness * loss, solid) / solid.distance.shape[1], _returned(glint, glass)])
    return Light(np.where(np.isfinite(distance), distance, 0.0), power)


def _returned(remission: NDArray[np.float64], hits: Hits) -> NDArray[np.float64]:
    return np.asarray(remission * hits.cosine / hits.distance**2)


def first_echo(light: Light) -> LaserEchoes:
    """Find the first stretch of a pulse's length from which enough comes back; its range is the mean weighted by power.

    So a beam that an edge splits gives a range between the two, a mixed pixel, if these are less than a pulse apart,
    and else the nearer one, if its share of the beam is bright enough.
    """
    behind = light.distance[:, None, :] - light.distance[:, :, None]  # (beams, first, others)
    together = np.where((behind >= 0) & (behind <= PULSE), light.power[:, None, :], 0.0)
    enough = (together.sum(axis=2) >= THRESHOLD) & (light.power > 0)
    first, seen = np.where(enough, light.distance, np.inf).argmin(axis=1), enough.any(axis=1)
    weights = np.where(seen[:, None], together[np.arange(len(first)), first], light.power)
    power = weights.sum(axis=1)
    mean = (weights * light.distance).sum(axis=1) / np.where(seen, power, 1.0)
    return LaserEchoes(np.where(seen, mean, np.inf), power)
