"""Arcs of bearings, in which beams of a laser are blind."""

import numpy as np
from numpy.typing import NDArray

ON_EDGE = 1e-9
"""A beam so little beside an arc [rad] is in it: it lies on its edge, but for rounding."""


def in_arc(beams: NDArray[np.float64], low: float, width: float) -> NDArray[np.bool_]:
    """Mask of bearings of ``beams`` (n,) from ``low`` counter-clockwise over ``width``, edges too [rad]; 2π is all."""
    inside: NDArray[np.bool_] = (beams - low + ON_EDGE) % (2 * np.pi) <= width + 2 * ON_EDGE
    return inside
