"""Lights of a spec, by their photometric intensities, for renderers that know those and for ones that do not."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from refseq_bench.worlds.parts.site import Site

DIM = {"sun": 0.5, "window": 0.1, "lamp": 0.15}
"""Brightness of each kind of light's colour. Filament multiplies it with the intensity, which is divided by it to make
up; the classic renderer, which knows no intensities, takes it alone."""
SIDE = 16
"""Pixels along each side of an image light's faces."""


def add_sun(site: Site, lux: float, beam: ArrayLike) -> None:
    """Add a directional light that casts shadows; ``lux`` [lx] fall on what faces it."""
    kind = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    _add(site, "sun", "sun", lux, type=kind, pos=[0.0, 0.0, 30.0], dir=beam, castshadow=True)


def add_spot(
    site: Site,
    name: str,
    kind: str,
    candela: float,
    pos: ArrayLike,
    axis: ArrayLike,
    cutoff: float,
    softness: float,
    reach: float,
) -> None:
    """Add a spot light; ``cutoff`` is the half angle of its cone [deg], ``reach`` how far it shines [m]."""
    spot = mujoco.mjtLightType.mjLIGHT_SPOT
    cone = {"cutoff": float(cutoff), "softness": float(softness), "range": reach}
    _add(site, name, kind, candela, type=spot, pos=pos, dir=axis, castshadow=False, **cone)


def _add(site: Site, name: str, kind: str, intensity: float, **options: object) -> None:
    dim = DIM[kind]
    site.spec.worldbody.add_light(
        name=name, intensity=intensity / dim, diffuse=[dim] * 3, specular=[0.0] * 3, ambient=[0.0] * 3, **options
    )


def add_image_light(site: Site, name: str, faces: tuple[int, ...], luminance: float) -> None:
    """Add light from all sides; ``faces`` (6) are bytes of ``luminance`` [cd/m²], +x −x +y −y +z −z of the cube."""
    texture = site.spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_CUBE, width=SIDE, height=6 * SIDE, nchannel=3
    )
    texture.data = np.repeat(np.array(faces, np.uint8), SIDE * SIDE * 3).tobytes()
    site.spec.worldbody.add_light(
        name=name,
        type=mujoco.mjtLightType.mjLIGHT_IMAGE,
        texture=name,
        intensity=luminance,
        diffuse=[0.0] * 3,
        specular=[0.0] * 3,
        castshadow=False,
    )
