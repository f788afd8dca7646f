"""Sunlit points: indoors through a window's opening, whose reveal cuts slanting light, up to the next wall."""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.form_factors import SKIN, hidden
from refseq_bench.worlds.lighting.photometry import GLAZING
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, Window


def sunlit(plan: FloorPlan, points: Floats, beam: Floats) -> Floats:
    """Return the share of direct sun that reaches ``points`` (m, 3) [m], (m,): the glazing's where it does, else 0.

    ``beam`` (3,) is the unit vector from the sun. The bars of the window's frame are left out.
    """
    share = np.zeros(len(points))
    for window in plan.window:
        share[_behind(plan, window, points, beam)] = GLAZING[window.glazing]
    return share


def _behind(plan: FloorPlan, window: Window, points: Floats, beam: Floats) -> NDArray[np.intp]:
    """Indices of the points that see the sun through a window: back along the beam through both ends of its opening."""
    wall = plan.wall_named(window.wall)
    frame = LocalFrame.of(wall)
    speed = float(beam[:2] @ frame.inward)
    if speed <= 0.0:
        return np.empty(0, dtype=np.intp)
    local = points[:, :2] - frame.origin
    out = local @ frame.inward
    way = out / speed
    passes = out > -SKIN
    for back in (way, way + wall.thickness / speed):
        s, z = local @ frame.along - back * (beam[:2] @ frame.along), points[:, 2] - back * beam[2]
        for at, (first, last) in ((s, window.extent), (z, window.rise)):
            passes &= (first <= at) & (at <= last)
    found = np.flatnonzero(passes)
    entry = (points[:, :2] - (way[:, None] - SKIN) * beam[:2])[found]
    each = np.arange(len(found))
    return found[~hidden(plan, points[found, :2] - SKIN * beam[:2], entry, each, each)]


def shaded(plan: FloorPlan, points: Floats, beam: Floats) -> NDArray[np.bool_]:
    """Tell which ``points`` (m, 3) in the open have a wall between them and the sun, (m,)."""
    shade = np.zeros(len(points), dtype=bool)
    for wall in plan.wall:
        frame = LocalFrame.of(wall)
        local, speed = points[:, :2] - frame.origin, float(beam[:2] @ frame.inward)
        if speed == 0.0:
            continue
        back = local @ frame.inward / speed
        s, z = local @ frame.along - back * (beam[:2] @ frame.along), points[:, 2] - back * beam[2]
        shade |= (back > SKIN) & (s >= 0.0) & (s <= wall.length) & (z <= plan.wall_height(wall))
    return shade
