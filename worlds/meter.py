"""A light meter for a plan: how much light falls on a small flat card, by the formulas of the built lights.

Sunlight is left out (it falls in patches) and nothing casts a shadow; this is for documents and tests.
"""

import numpy as np
from numpy.typing import ArrayLike

from worlds.frame import Frame
from worlds.light import LightSetting
from worlds.photometry import CUTOFF, LOBE, REACH, glass_area, photometry, window_luminance
from worlds.schema import FloorPlan


def illuminance(plan: FloorPlan, setting: LightSetting, point: ArrayLike, normal: ArrayLike) -> float:
    """Return the illuminance [lx] at ``point`` (3,) [m] on a card that faces along ``normal`` (3,)."""
    point, normal = np.asarray(point, dtype=float), np.asarray(normal, dtype=float)
    numbers = photometry(plan, setting)
    total = numbers.indirect
    for window in plan.window:
        wall = plan.wall_named(window.wall)
        frame = Frame.of(wall)
        source = frame.point(window.at, -wall.thickness, window.sill + window.height / 2)
        axis = np.append(frame.inward, 0.0)
        candela = window_luminance(plan, window, numbers.outdoors) * glass_area(window)
        total += _spot(candela, source, axis, point, normal)
    for row in (row for row in plan.lamp if row.name in numbers.burning):
        for x, y in row.positions:
            source = np.array([x, y, plan.ceiling.height - 0.06])
            total += _spot(row.lumen / (np.pi * LOBE), source, np.array([0.0, 0.0, -1.0]), point, normal)
    return total


def _spot(candela: float, source: np.ndarray, axis: np.ndarray, point: np.ndarray, normal: np.ndarray) -> float:
    """Illuminance from one spot [lx]: I(θ) cosβ / d², faded towards ``REACH``."""
    ray = point - source
    d = float(np.linalg.norm(ray))
    edge = np.cos(np.radians(CUTOFF))
    cone = max(0.0, (float(ray @ axis) / d - edge) / (1.0 - edge)) ** 2
    fade = max(0.0, 1.0 - (d / REACH) ** 4) ** 2
    return candela * cone * fade * max(0.0, -float(ray @ normal) / d) / d**2
