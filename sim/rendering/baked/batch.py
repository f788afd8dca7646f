"""Triangles on the device, in the order of their pictures."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.rendering.baked.programs import Programs
from refseq_bench.sim.rendering.baked.surfaces import Surfaces
from refseq_bench.sim.rendering.baked.triangles import Floats, distinct

LAYOUTS = {
    True: ("3f 3f 2f 2f 4f", "place", "normal", "uv", "chart", "look"),
    False: ("3f 12x 2f 2f 4f", "place", "uv", "chart", "look"),
}
"""Columns that are read of a vertex where there is a sun, and where not."""
PLACE_ALONE = ("3f 44x", "place")
COLUMNS = 14
PLACE, NORMAL, LUX = slice(0, 3), slice(3, 6), 10
"""Columns of a vertex that change where things move."""
CALL = 20
"""Bytes of a call to draw: five numbers of four."""
NEARER = 1e-3
"""A sheet comes nearer to the eye by this share of its distance: farther off, it and its wall are equally deep."""


class Batch:
    """Some of the surfaces' triangles, in the light ``lux`` (n, 3) on the corners of all [lx].

    ``vertices`` (m, 14) are those that differ, in the frames of their ``bodies`` (m,).
    """

    def __init__(self, programs: Programs, surfaces: Surfaces, which: NDArray[np.intp], lux: Floats) -> None:
        texture = np.array([finish.texture for finish in surfaces.finish])[surfaces.geom]
        which = which[np.lexsort((surfaces.geom[which], texture[which]))]
        self._programs, self._pieces = programs, _pieces(surfaces, which)
        body = np.repeat(surfaces.body[which], 3)
        first, index = _distinct(corners := _vertices(surfaces, which, lux[which]), body)
        self.vertices, self.bodies = corners[first], body[first]
        self._buffer = programs.context.buffer(self.vertices.tobytes() or bytes(4 * COLUMNS))
        self._calls = programs.context.buffer(reserve=max(1, len(self._pieces.first)) * CALL)
        casting = np.repeat(surfaces.casts[surfaces.geom[which]], 3)
        self._drawn = self._array(programs.picture, LAYOUTS[programs.sunny], index)
        self.casters = np.unique(index[casting])
        """Indices of the vertices of what throws shadows."""
        self._shadow = self._array(programs.depth, PLACE_ALONE, index[casting])

    def _array(self, program: Any, layout: tuple[str, ...], index: NDArray[np.intp]) -> Any:
        if not len(index):
            return None
        context = self._programs.context
        indices = context.buffer(index.astype(np.uint32).tobytes())
        return context.vertex_array(program, [(self._buffer, *layout)], index_buffer=indices)

    def write(self, vertices: NDArray[np.float32]) -> None:
        """Put the vertices elsewhere, (m, 14)."""
        if len(vertices):
            self._buffer.write(vertices.tobytes())

    def draw(self, pictures: Mapping[int, Any], seen: NDArray[np.intp]) -> None:
        """Draw some of the pieces in their order, but first what is closed, and together what has one picture."""
        if not len(seen):
            return
        kind = 2 * self._pieces.texture[seen] + ~self._pieces.closed[seen]
        _, first, of = np.unique(kind, return_index=True, return_inverse=True)
        order = np.lexsort((first[of], kind % 2))
        seen, kind = seen[order], kind[order]
        calls = np.zeros((len(seen), 5), np.uint32)
        calls[:, 0], calls[:, 1], calls[:, 2] = self._pieces.count[seen], 1, self._pieces.first[seen]
        self._calls.write(calls.tobytes())
        begins = np.flatnonzero(np.diff(kind, prepend=kind[:1] - 1))
        for begin, end in pairwise([*begins.tolist(), len(seen)]):
            self._cull(closed=kind[begin] % 2 == 0)
            pictures[int(kind[begin]) // 2].use(0)
            self._drawn.render_indirect(self._calls, count=end - begin, first=begin)
        self._cull(closed=False)

    def _cull(self, *, closed: bool) -> None:
        """Leave out what is seen from behind, or leave it in."""
        context = self._programs.context
        (context.enable if closed else context.disable)(context.CULL_FACE)

    def in_sight(self, planes: Floats, eye: Floats) -> NDArray[np.intp]:
        """Pieces that reach into the view whose sides are ``planes`` (k, 4), from the nearest to ``eye`` (3,) on."""
        centres, radii = self._pieces.centre, self._pieces.radius
        inside = (centres @ planes[:, :3].T + planes[:, 3] > -radii[:, None]).all(axis=1)
        apart = np.linalg.norm(centres - eye, axis=1) - radii
        return np.flatnonzero(inside)[np.argsort(apart[inside], kind="stable")]

    @property
    def all(self) -> NDArray[np.intp]:
        """All pieces."""
        return np.arange(len(self._pieces.first))

    def cast(self) -> None:
        """Draw what throws shadows."""
        if self._shadow is not None:
            self._shadow.render()


@dataclass(frozen=True, slots=True)
class Pieces:
    """Runs of triangles, each of one geom and one ``texture``: ``count`` corners from the ``first`` on, all (k,).

    All lie within ``radius`` (k,) of ``centre`` (k, 3) [m]. Those that are ``closed`` (k,) are seen from outside alone.
    """

    texture: NDArray[np.intp]
    first: NDArray[np.intp]
    count: NDArray[np.intp]
    centre: Floats
    radius: Floats
    closed: NDArray[np.bool_]


def _pieces(surfaces: Surfaces, which: NDArray[np.intp]) -> Pieces:
    geom = surfaces.geom[which]
    first = np.flatnonzero(np.diff(geom, prepend=-1))
    count = np.diff(np.append(first, len(which)))
    parts = [surfaces.triangles.corners[which[a : a + n]].reshape(-1, 3) for a, n in zip(first, count, strict=True)]
    centre = np.array([(part.min(axis=0) + part.max(axis=0)) / 2 for part in parts]).reshape(-1, 3)
    radius = [np.linalg.norm(part - middle, axis=1).max() for part, middle in zip(parts, centre, strict=True)]
    texture = np.array([surfaces.finish[geom].texture for geom in geom[first]], np.intp)
    return Pieces(texture, 3 * first, 3 * count, centre, np.array(radius), surfaces.closed[geom[first]])


def _vertices(surfaces: Surfaces, which: NDArray[np.intp], lux: Floats) -> NDArray[np.float32]:
    """Corners of triangles (3 n, 14) as the device takes them, in the frames of their bodies."""
    triangles, look = surfaces.triangles[which], np.empty((len(which), 3, 4))
    finish = np.array([(one.albedo, one.emission) for one in surfaces.finish])[surfaces.geom[which]]
    look[..., 0] = lux
    look[..., 1:3] = finish[:, None]
    look[..., 3] = np.where(surfaces.flat[surfaces.geom[which]], NEARER, 0.0)[:, None]
    parts = (triangles.corners, triangles.normals, triangles.uv, surfaces.chart[which], look)
    return np.concatenate(parts, axis=2).reshape(-1, COLUMNS).astype(np.float32)


def _distinct(vertices: NDArray[np.float32], body: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of vertices that differ to the bit, and which of these each one is."""
    codes = np.column_stack([np.ascontiguousarray(vertices).view(np.uint32), body]).astype(np.uint64)
    return distinct(codes)
