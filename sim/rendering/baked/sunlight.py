"""A map of what the sun sees: how far off along its beam the first thing lies, by place across the beam."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from refseq_bench.sim.rendering.baked.triangles import Floats

EDGE = 3
"""Texels around what is on a map that stay empty: beside the map all is as at its edge, in the sun."""
FINEST = 1e-3
"""No texel is smaller than this [m]."""
LARGEST = 16_384
"""A map has so many texels along a side at most: as many as OpenGL 4 promises, for a corridor along the sun's way."""
BIAS = 2e-3
"""A surface is lit when it lies no farther than this behind the map's [m]."""


class SunMapFrame(NamedTuple):
    """``matrix`` (4, 4) from the world onto the map's cube of −1 to 1, its ``size`` and the side of a ``texel`` [m]."""

    matrix: Floats
    size: tuple[int, int]
    texel: float


def frame_over(points: Floats, towards: Floats, texels: int) -> SunMapFrame:
    """Lay a map of about so many texels over points (n, 3) [m], seen from the sun, which is ``towards`` (3,)."""
    across = np.cross([0.0, 0.0, 1.0] if abs(towards[2]) < 0.9 else [1.0, 0.0, 0.0], towards)
    across /= np.linalg.norm(across)
    # The long side of what is there lies along an axis of the map: a corridor fills a band, not a square's diagonal.
    axes = np.stack([across, np.cross(towards, across)])
    spread = (points - points.mean(axis=0)) @ axes.T
    _, turned = np.linalg.eigh(spread.T @ spread)
    axes = turned.T[::-1] @ axes
    beam = np.cross(axes[0], axes[1])
    if beam @ towards < 0.0:
        axes[1], beam = -axes[1], -beam
    rotation = np.vstack([axes, -beam])  # away from the sun is deeper
    local = points @ rotation.T
    low, high = local.min(axis=0), local.max(axis=0) + BIAS
    wide, tall = high[:2] - low[:2]
    most = LARGEST - 2 * EDGE - 1  # one to spare: a side that is rounded up must fit
    texel = max(math.sqrt(wide * tall / texels), max(wide, tall) / most, FINEST)
    columns, rows = (int(n) + 2 * EDGE for n in np.ceil((high - low)[:2] / texel))
    middle = (low[:2] + high[:2]) / 2
    half = texel / 2 * np.array([columns, rows])
    low[:2], high[:2] = middle - half, middle + half
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * (2.0 / (high - low))[:, None]
    matrix[:3, 3] = -(high + low) / (high - low)
    matrix[2, 3] -= 2.0 * BIAS / (high[2] - low[2])
    return SunMapFrame(matrix, (columns, rows), texel)


class SunMap:
    """A depth map on the device; where nothing was drawn all is in the sun."""

    def __init__(self, context: Any, frame: SunMapFrame) -> None:
        self.frame = frame
        self.depth = context.depth_texture(frame.size)
        self.depth.compare_func = "<="
        self.depth.repeat_x = self.depth.repeat_y = False
        self.depth.filter = context.LINEAR, context.LINEAR
        self._buffer = context.framebuffer(depth_attachment=self.depth)
        self._buffer.clear(depth=1.0)

    def draw(self, program: Any, cast: Callable[[], None]) -> None:
        """Draw on it by ``program`` what ``cast`` draws."""
        self._buffer.use()
        program["onto_map"].write(column_major(self.frame.matrix))
        cast()

    def release(self) -> None:
        """Give the device's memory back."""
        self._buffer.release()
        self.depth.release()


def column_major(matrix: Floats) -> bytes:
    """Bytes of a matrix as the device takes it."""
    return np.ascontiguousarray(matrix.T, np.float32).tobytes()
