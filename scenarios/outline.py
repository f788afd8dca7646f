"""A world's walls, doors and furniture as lines in the plan, for reports."""

import numpy as np
from numpy.typing import NDArray

from worlds.footprints import corners, footprints
from worlds.frame import Frame
from worlds.schema import Cabinet, Door, FloorPlan, Standing, Wall, Window

OPENING = 0.06
"""How far the line of a door or window stands back from the wall's face [m]: to be told from the wall."""


AROUND = [0, 1, 3, 2, 0]
"""Corners of a footprint in the order of a walk around it; they come as those of a grid."""


def outline_of(plan: FloorPlan) -> list[NDArray[np.float64]]:
    """Polylines (m, 2) [m]: faces of the walls with doors and windows set back, and around what stands on the floor."""
    things: tuple[Cabinet | Standing, ...] = (*plan.cabinet, *plan.furniture, *plan.stairs, *plan.car)
    grounds = [corners(shape)[AROUND] for thing in things for shape in footprints(plan, thing)]
    return [*(_wall(plan, wall) for wall in plan.wall), *grounds]


def _wall(plan: FloorPlan, wall: Wall) -> NDArray[np.float64]:
    """One line along the wall that steps back where a door or a window is."""
    frame = Frame.of(wall)
    openings: tuple[Door | Window, ...] = (*plan.door, *plan.window)
    bends = [(0.0, 0.0)]
    for opening in sorted((one for one in openings if one.wall == wall.name), key=lambda one: one.at):
        start, end = opening.extent
        back = -OPENING if isinstance(opening, Window) else -opening.recess
        bends += [(start, 0.0), (start, back), (end, back), (end, 0.0)]
    return _points(frame, [*bends, (wall.length, 0.0)])


def _points(frame: Frame, places: list[tuple[float, float]]) -> NDArray[np.float64]:
    """From (along the wall, out of it) to the plan."""
    return np.array([frame.point(along, out, 0.0)[:2] for along, out in places])
