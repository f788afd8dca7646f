"""A world's walls as lines in the plan, for reports."""

import numpy as np
from numpy.typing import NDArray

from worlds.schema import FloorPlan


def outline_of(plan: FloorPlan) -> list[NDArray[np.float64]]:
    """Inner faces of all walls, (2, 2) each [m]."""
    return [np.array([wall.start, wall.end], float) for wall in plan.wall]
