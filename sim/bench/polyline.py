"""Routes as polylines in the plane: checked once for all who drive along them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq_bench.sim.errors import SimError


def polyline(route: ArrayLike) -> NDArray[np.float64]:
    """Return a private copy of ``route`` (n, 2) [m] without repeated points. Raises ``SimError`` for what is none."""
    points = np.array(route, float)
    if points.ndim != 2 or points.shape[1:] != (2,):
        raise SimError(f"a route has shape (n, 2), not {points.shape}")
    if not np.isfinite(points).all():
        raise SimError("a route's points must be finite")
    moved = np.any(np.diff(points, axis=0) != 0, axis=1)
    points = points[np.concatenate([[True], moved])] if len(points) else points
    if len(points) < 2:
        raise SimError(f"a route needs two different points, not {len(points)}")
    return points
