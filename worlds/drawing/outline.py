"""A world's walls, doors and furniture as lines in the plan, for reports."""

import math

import numpy as np
from numpy.typing import NDArray

from worlds.plans.footprints import corners, footprints
from worlds.plans.frame import Frame
from worlds.plans.schema import Cabinet, Door, FloorPlan, Standing, Wall, Window

OPENING = 0.06
"""How far the line of a door or window stands back from the wall's face [m]: to be told from the wall."""


AROUND = [0, 1, 3, 2, 0]
"""Corners of a footprint in the order of a walk around it; they come as those of a grid."""


def outline_of(plan: FloorPlan) -> list[NDArray[np.float64]]:
    """Polylines (m, 2) [m]: faces of the walls with doors and windows set back, and around what stands on the floor.

    Where a door is open there is a gap, and its leaf as it stands.
    """
    things: tuple[Cabinet | Standing, ...] = (*plan.cabinet, *plan.furniture, *plan.stairs, *plan.car)
    grounds = [corners(shape)[AROUND] for thing in things for shape in footprints(plan, thing)]
    return [*(line for wall in plan.wall for line in _wall(plan, wall)), *grounds]


def _wall(plan: FloorPlan, wall: Wall) -> list[NDArray[np.float64]]:
    """Lines along the wall that step back where a door or a window is, and end on both sides of an open door."""
    openings: tuple[Door | Window, ...] = (*plan.door, *plan.window)
    lines, leaves = [[(0.0, 0.0)]], []
    for opening in sorted((one for one in openings if one.wall == wall.name), key=lambda one: one.at):
        start, end = opening.extent
        back = -OPENING if isinstance(opening, Window) else -opening.recess
        lines[-1] += [(start, 0.0), (start, back)]
        if isinstance(opening, Door) and opening.open:
            leaves.append(_leaf(opening))
            lines.append([])
        lines[-1] += [(end, back), (end, 0.0)]
    lines[-1].append((wall.length, 0.0))
    frame = Frame.of(wall)
    return [_points(frame, line) for line in (*lines, *leaves)]


def _leaf(door: Door) -> list[tuple[float, float]]:
    """From the hinge to the tip of a door's leaf, which opens away from the room."""
    start, end = door.extent
    hinge, along = (start, 1.0) if door.hinge == "start" else (end, -1.0)
    angle = math.radians(door.open)
    tip = hinge + along * door.width * math.cos(angle), -door.recess - door.width * math.sin(angle)
    return [(hinge, -door.recess), tip]


def _points(frame: Frame, places: list[tuple[float, float]]) -> NDArray[np.float64]:
    """From (along the wall, out of it) to the plan."""
    return np.array([frame.point(along, out, 0.0)[:2] for along, out in places])
