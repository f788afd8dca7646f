"""A world's walls, doors and furniture as lines in the plan, for reports."""

import numpy as np
from numpy.typing import NDArray

from worlds.frame import Frame
from worlds.schema import Cabinet, Door, FloorPlan, Wall, Window

OPENING = 0.06
"""How far the line of a door or window stands back from the wall's face [m]: to be told from the wall."""


def outline_of(plan: FloorPlan) -> list[NDArray[np.float64]]:
    """Inner faces of the walls with their doors and windows set back, and the cabinets: polylines (m, 2) [m]."""
    return [*(_wall(plan, wall) for wall in plan.wall), *(_cabinet(plan, cabinet) for cabinet in plan.cabinet)]


def _wall(plan: FloorPlan, wall: Wall) -> NDArray[np.float64]:
    """One line along the wall that steps back where a door or a window is."""
    frame = Frame.of(wall)
    openings: list[Door | Window] = [item for item in (*plan.door, *plan.window) if item.wall == wall.name]
    corners = [(0.0, 0.0)]
    for opening in sorted(openings, key=lambda item: item.at):
        start, end = opening.extent
        back = -OPENING if isinstance(opening, Window) else -opening.recess
        corners += [(start, 0.0), (start, back), (end, back), (end, 0.0)]
    return _points(frame, [*corners, (wall.length, 0.0)])


def _cabinet(plan: FloorPlan, cabinet: Cabinet) -> NDArray[np.float64]:
    frame = Frame.of(plan.wall_named(cabinet.wall))
    start, end = cabinet.extent
    return _points(frame, [(start, 0.0), (start, cabinet.depth), (end, cabinet.depth), (end, 0.0)])


def _points(frame: Frame, corners: list[tuple[float, float]]) -> NDArray[np.float64]:
    """From (along the wall, out of it) to the plan."""
    return np.array([frame.point(along, out, 0.0)[:2] for along, out in corners])
