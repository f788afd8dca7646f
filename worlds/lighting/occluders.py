"""Triangles that light cannot pass, and rays that ask what is in their way."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from refseq_bench.worlds.arrays import Floats

AWAY = 1e-3
"""Rays begin so far in front of the surface that they leave [m], and end so far before what they go to."""


class Occluders:
    """Triangles (n, 3, 3) [m] in a tree of boxes, by Embree."""

    def __init__(self, corners: Floats) -> None:
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(corners, np.float32))
        if not len(corners):
            raise ValueError("corners: no triangles; valid are one or more")

    def hit(self, origins: NDArray[np.floating], directions: NDArray[np.floating]) -> NDArray[np.int32]:
        """Return which triangle each ray meets first, (m,); -1: none. Rays are cast in single precision."""
        found = self._scene.run(_single(origins), _single(directions))
        return np.asarray(found, np.int32)

    def clear(self, origins: Floats, targets: Floats) -> NDArray[np.bool_]:
        """Tell which points (m, 3) see their target (m, 3)."""
        ways = targets - origins
        lengths = np.linalg.norm(ways, axis=1)
        reach = np.maximum(lengths - AWAY, 0.0).astype(np.float32)
        directions = ways / np.where(lengths > 0.0, lengths, 1.0)[:, None]
        return self._open(origins, directions, reach)

    def open_to(self, origins: Floats, direction: Floats) -> NDArray[np.bool_]:
        """Tell from which points (m, 3) nothing is met along a direction (3,), as that of the sun."""
        directions = np.broadcast_to(direction, origins.shape)
        return self._open(origins, directions, np.full(len(origins), 1e30, np.float32))

    def _open(self, origins: Floats, directions: Floats, reach: NDArray[np.float32]) -> NDArray[np.bool_]:
        met = self._scene.run(_single(origins), _single(directions), query="OCCLUDED", dists=reach)
        return np.asarray(met, np.int32) < 0


def _single(vectors: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.ascontiguousarray(vectors, np.float32)
