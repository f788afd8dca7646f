"""The lights of a model that no world stands behind: lamps without size, and one light from all sides, unshaded."""

from typing import NamedTuple

import mujoco
import numpy as np

from refseq_bench.sim.rendering.baked.triangles import Floats
from refseq_bench.worlds.lighting.baking import Baked, Shell
from refseq_bench.worlds.lighting.form_factors import Cards

KIND = mujoco.mjtLightType


class Sun(NamedTuple):
    """A directional light: ``lux`` [lx] on what faces it, the unit vector ``towards`` it, and its ``shadows``."""

    lux: float
    towards: Floats
    shadows: bool


def sun_of(model: mujoco.MjModel) -> Sun:
    """The model's first directional light that shines; one of 0 lx where there is none."""
    shining = brightness(model)
    for light in np.flatnonzero((model.light_type == KIND.mjLIGHT_DIRECTIONAL) & (shining > 0.0)):
        way = model.light_dir[light]
        return Sun(float(shining[light]), -way / np.linalg.norm(way), bool(model.light_castshadow[light]))
    return Sun(0.0, np.array([0.0, 0.0, 1.0]), shadows=False)


def brightness(model: mujoco.MjModel) -> Floats:
    """Intensity of each light [lx, cd or cd/m², by its kind], (nlight,); 0 where it is off."""
    return np.where(model.light_active != 0, model.light_intensity * model.light_diffuse[:, 0], 0.0)


def bake_lamps(model: mujoco.MjModel, shell: Shell, others: Cards) -> Baked:
    """See ``Bake``: E = I(θ) cosβ / d², faded towards the lamp's range as Filament does, and the image light."""
    own = len(shell.cards)
    points = np.concatenate([shell.cards.points, others.points])
    normals = np.concatenate([shell.cards.normals, others.normals])
    image = model.light_type == KIND.mjLIGHT_IMAGE
    lux = np.full(len(points), np.pi * model.light_intensity[image].sum())
    rest = mujoco.MjData(model)
    mujoco.mj_forward(model, rest)
    candela = brightness(model)
    lamps = (model.light_type == KIND.mjLIGHT_POINT) | (model.light_type == KIND.mjLIGHT_SPOT)
    for lamp in np.flatnonzero(lamps).tolist():
        ways = points - rest.light_xpos[lamp]
        d = np.linalg.norm(ways, axis=1)
        facing = np.maximum(0.0, -np.einsum("nc,nc->n", ways, normals) / d)
        fade = np.maximum(0.0, 1.0 - (d / model.light_range[lamp]) ** 4) ** 2
        lux += candela[lamp] * _cone(model, lamp, ways @ rest.light_xdir[lamp] / d) * facing * fade / d**2
    return Baked(lux[:own], np.zeros(own, bool), lux[own:])


def _cone(model: mujoco.MjModel, lamp: int, cosine: Floats) -> Floats:
    """Share of a spot's intensity by the cosine of the angle to its axis; a point light's is 1 all around."""
    if model.light_type[lamp] == KIND.mjLIGHT_POINT:
        return np.ones_like(cosine)
    cutoff = np.radians(model.light_cutoff[lamp])
    outer, inner = np.cos(cutoff), np.cos(cutoff * (1.0 - model.light_softness[lamp]))
    return np.asarray(np.clip((cosine - outer) / max(inner - outer, 1e-6), 0.0, 1.0) ** 2)
