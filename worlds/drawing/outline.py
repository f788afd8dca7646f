"""A world's walls, doors and furniture as lines in the plan, for reports."""

import math

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.footprints import corners, footprints
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Cabinet, Door, FloorPlan, Standing, Wall, Window

OPENING = 0.06
"""Distance by which the line of a door or window stands back from the wall's face [m]: to be told from the wall."""


def outline_of(plan: FloorPlan) -> list[Floats]:
    """Polylines (m, 2) [m]: faces of the walls with doors and windows set back, and around what stands on the floor.

    Where a door is open there is a gap, and its leaf as it stands.
    """
    things: tuple[Cabinet | Standing, ...] = (*plan.cabinet, *plan.furniture, *plan.stairs, *plan.car)
    grounds = [corners(shape)[[0, 1, 2, 3, 0]] for thing in things for shape in footprints(plan, thing)]
    return [*(line for wall in plan.wall for line in _wall(plan, wall)), *grounds]


def _wall(plan: FloorPlan, wall: Wall) -> list[Floats]:
    """Lines along the wall that step back where a door or a window is, and end on both sides of an open door."""
    frame, leaves = LocalFrame.of(wall), []
    lines = [[(0.0, 0.0)]]
    for opening in plan.openings_in(wall):
        start, end = opening.extent
        back = -OPENING if isinstance(opening, Window) else -opening.recess
        lines[-1] += [(start, 0.0), (start, back)]
        if isinstance(opening, Door) and opening.open:
            leaf = frame.leaf(opening, math.radians(opening.open))
            leaves.append(np.array([leaf.origin, leaf.point(opening.width, 0.0, 0.0)[:2]]))
            lines.append([])
        lines[-1] += [(end, back), (end, 0.0)]
    lines[-1].append((wall.length, 0.0))
    return [*(np.array([frame.point(s, out, 0.0)[:2] for s, out in line]) for line in lines), *leaves]
