"""A picture of the sky all around, with the town at its horizon: luminances [cd/m²] that give the daylight's lux."""

import cv2
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.daylight import Daylight
from refseq_bench.worlds.parts.greyscale import cloud

LOWEST, BEND, HIGHEST = np.radians((-4.0, 22.0, 90.0))
"""Elevations [rad] at the lower edge, in the middle and at the upper edge of the picture of the sky: finer below."""
SIMPLER = 4
"""The sky itself is drawn at a fraction of the picture's size: it has no edges."""
TOWN_GLOW = np.radians(12.0)
"""Elevation up to which a town lights its sky at night [rad]; a choice."""
CORONA = np.radians(6.0)
"""So near to the sun its glare is drawn no brighter [rad]: the sun itself is a light, and no picture."""


def elevations(height: int) -> Floats:
    """Elevation of each row of a picture of the sky, (height,) [rad], from the zenith down."""
    share = (np.arange(height) + 0.5) / height
    return np.interp(share, [0.0, 0.5, 1.0], [HIGHEST, BEND, LOWEST])


def sky(size: tuple[int, int], light: Daylight, sun: float, rng: Generator) -> Floats:
    """Luminance of the sky all around, (height, width) of ``size`` (width, height) [cd/m²].

    Columns run clockwise as seen from inside, their azimuths from π down to −π; the sun is at azimuth ``sun`` [rad].
    Clear sky after Kittler, clouds as bright as the CIE overcast sky; at night a town's glow. The whole is scaled so
    that it gives ``light.sky`` on level ground.
    """
    width, height = size
    up = np.maximum(elevations(height), np.radians(1.0))[:, None]
    dark = float(np.clip(-light.elevation / np.radians(6.0), 0.0, 1.0))
    gap = np.arccos(np.clip(_cosine_to_sun(up, _azimuths(width), light.elevation, sun), -1.0, 1.0))
    clear = (1 - dark) * _clear(up, np.maximum(gap, CORONA), light.elevation) + dark * np.exp(-up / TOWN_GLOW)
    overcast = (1 - dark) * (1.0 + 2.0 * np.sin(up)) / 3.0 + dark * (0.3 + np.exp(-up / TOWN_GLOW))
    cover, shading = _clouds((height, width), light.cloud, rng)
    field = (1.0 - cover) * clear + cover * overcast * shading
    return field * light.sky / illuminance_of(field)


def illuminance_of(field: Floats) -> float:
    """Illuminance on level ground [lx] by the sky of luminance ``field`` [cd/m²]: ∫ L sin(γ) cos(γ) dγ dα."""
    edges = np.interp(np.arange(len(field) + 1) / len(field), [0.0, 0.5, 1.0], [HIGHEST, BEND, LOWEST])
    weight = np.sin(np.maximum(edges, 0.0)) ** 2
    return float(np.pi * np.sum((weight[:-1] - weight[1:]) * field.mean(axis=1)))


def _azimuths(width: int) -> Floats:
    return np.pi - 2 * np.pi * (np.arange(width) + 0.5) / width


def _cosine_to_sun(up: Floats, around: Floats, elevation: float, sun: float) -> Floats:
    return np.sin(up) * np.sin(elevation) + np.cos(up) * np.cos(elevation) * np.cos(around - sun)


def _clear(up: Floats, gap: Floats, elevation: float) -> Floats:
    """CIE clear sky (Kittler 1967), over its value at the zenith; common knowledge, not looked up again (M)."""

    def scattered(angle: Floats | float) -> Floats:
        return 0.91 + 10.0 * np.exp(-3.0 * np.asarray(angle)) + 0.45 * np.cos(angle) ** 2

    zenith = scattered(np.pi / 2 - max(elevation, 0.0)) * (1.0 - np.exp(-0.32))
    return scattered(gap) * (1.0 - np.exp(-0.32 / np.sin(up))) / zenith


def _clouds(shape: tuple[int, int], share: float, rng: Generator) -> tuple[Floats, Floats]:
    """Cover 0..1 and brightness of the clouds, (height, width) each; ``share`` of the picture is covered."""
    height, width = shape
    half = cloud((height, width // 2), rng, coarsest=3, octaves=6, fall=0.6)
    field = np.hstack([half, half[:, ::-1]])  # no seam where the picture closes
    if share <= 0.0:
        return np.zeros(shape), np.ones(shape)
    cover = np.clip((field - np.quantile(field, 1.0 - share)) / 0.5 + 0.5, 0.0, 1.0) if share < 1.0 else np.ones(shape)
    return cover, np.clip(1.0 - 0.14 * field, 0.5, 1.5)


def panorama(size: tuple[int, int], light: Daylight, sun: float, albedo: float, rng: Generator) -> Floats:
    """Luminance of the sky and of trees and houses far around, (height, width) [cd/m²]; see ``sky``."""
    width, height = size
    small = sky((width // SIMPLER, height // SIMPLER), light, sun, rng)
    field = np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR), np.float64)
    facing = np.cos(light.elevation) * np.maximum(0.0, -np.cos(_azimuths(width) - sun))
    level = (light.sky + albedo * light.ground) / 2  # on an upright wall, without the sun
    around = (level + light.direct * facing) / np.pi  # (width,), of white walls
    up, night = elevations(height), light.night
    field[up < 0.0] = albedo * light.ground / np.pi
    for reach, tall in ((0.6, 5.5), (1.0, 3.5)):
        _far_houses(field, around * reach, up, tall, night, rng)
        _far_trees(field, around * reach, up, tall, rng)
    return field


# --- the horizon ---


def _row(up: Floats, degrees: float) -> int:
    return int(np.searchsorted(-up, -np.radians(degrees)))


def _far_trees(field: Floats, around: Floats, up: Floats, tall: float, rng: Generator) -> None:
    width = field.shape[1]
    grain = np.abs(cloud((32, width // 8), rng, coarsest=8, octaves=5, fall=0.75)[16])
    line = cv2.resize(grain[None, :], (width, 1), interpolation=cv2.INTER_CUBIC)[0]
    rough = 0.25 * rng.standard_normal(width)
    tops = np.clip(0.7 + 0.3 * tall * (line - 0.5) + rough, 0.2, tall)  # degrees
    rows = slice(_row(up, tall), _row(up, -0.5))
    leaf = 0.09 * np.maximum(0.0, 1.0 + 0.35 * rng.standard_normal((rows.stop - rows.start, width)))
    mask = np.degrees(up[rows, None]) < tops
    field[rows][mask] = (leaf * around)[mask]


def _far_houses(field: Floats, around: Floats, up: Floats, tall: float, night: bool, rng: Generator) -> None:
    x, width = 0, field.shape[1]
    while x < width:
        w = int(rng.integers(60, 240))
        if rng.random() < 0.55:
            _far_house(field[:, x : x + w], around[x : x + w], up, rng.uniform(0.4, 1.0) * tall, night, rng)
        x += w + int(rng.integers(0, 160))


def _far_house(field: Floats, around: Floats, up: Floats, tall: float, night: bool, rng: Generator) -> None:
    top, foot = _row(up, tall), _row(up, -0.5)
    field[top:foot] = rng.uniform(0.25, 0.6) * around
    step = int(rng.integers(9, 15))
    for u in range(4, field.shape[1] - step, step):
        for v in range(top + 4, foot - step, step):
            shade = rng.uniform(0.05, 0.12) * around[u]
            lit = rng.random() < 0.12 and night
            field[v : v + step // 2, u : u + step // 2] = rng.uniform(5.0, 30.0) if lit else shade
