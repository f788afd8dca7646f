"""Triangles, each with corners of its own: cut small where light is to vary over them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HALVES = np.array([[0, 1, 2], [0, 2, 3]])
"""Corners of the two triangles of a quadrangle: light is matched to them by it, so that all cut alike."""
HALVES.setflags(write=False)


@dataclass(frozen=True, slots=True)
class Triangles:
    """``corners`` (n, 3, 3) [m], counter-clockwise from outside, their ``normals`` (n, 3, 3) and ``uv`` (n, 3, 2).

    ``uv`` is the place in a picture, from its upper left corner, 1 at the lower right one.
    """

    corners: Floats
    normals: Floats
    uv: Floats

    def __len__(self) -> int:
        return len(self.corners)

    @classmethod
    def flat(cls, corners: Floats, uv: Floats | None = None) -> Self:
        """Return triangles whose normals are those of their planes."""
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(across, axis=1, keepdims=True)
        normals = across / np.where(length > 0.0, length, 1.0)
        uv = np.zeros((len(corners), 3, 2)) if uv is None else uv
        return cls(corners, np.repeat(normals[:, None], 3, axis=1), uv)

    @classmethod
    def joined(cls, parts: Sequence["Triangles"]) -> Self:
        """Put several together, in their order."""
        several = ([getattr(part, name) for part in parts] for name in ("corners", "normals", "uv"))
        return cls(*(np.concatenate(arrays) for arrays in several))

    def placed(self, position: Floats, rotation: Floats) -> "Triangles":
        """Move by a rotation (3, 3) and then to a ``position`` (3,)."""
        return Triangles(self.corners @ rotation.T + position, self.normals @ rotation.T, self.uv)

    def __getitem__(self, which: NDArray[np.intp] | NDArray[np.bool_] | slice) -> "Triangles":
        return Triangles(self.corners[which], self.normals[which], self.uv[which])

    @property
    def area(self) -> float:
        """Area of all together [m²]."""
        edges = self.corners[:, 1:] - self.corners[:, :1]
        return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2)

    def cut(self, longest: Floats) -> tuple["Triangles", NDArray[np.intp]]:
        """Cut at the middles of edges until none is longer than its triangle's ``longest`` (n,) [m].

        Returns the pieces, and of which triangle each one is. Every edge is cut by its own length alone, so that
        neighbours cut the one they share alike and no gap opens.
        """
        pieces, of = self, np.arange(len(self))
        done, done_of = [self[:0]], [of[:0]]
        while len(pieces):
            lengths = np.linalg.norm(np.roll(pieces.corners, -1, axis=1) - pieces.corners, axis=2)
            long = lengths > longest[of][:, None]
            whole = ~long.any(axis=1)
            done.append(pieces[whole])
            done_of.append(of[whole])
            pieces, halved = _halved(pieces[~whole], long[~whole])
            of = of[~whole][halved]
        return Triangles.joined(done), np.concatenate(done_of)


def distinct(rows: NDArray[np.uint64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of rows that differ, and which of these each row is; by a hash, as sorting whole rows is slow."""
    mix = np.random.default_rng(0).integers(1, 2**63, rows.shape[1], dtype=np.uint64)
    _, first, index = np.unique((rows * mix).sum(axis=1), return_index=True, return_inverse=True)
    return first, index


_PIECES = {
    1: ((0, 3, 2), (3, 1, 2)),
    2: ((0, 3, 2), (3, 4, 2), (3, 1, 4)),
    3: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
}
"""Pieces of a triangle with 1, 2 or all edges cut, from the first on; 0 to 2 are its corners, 3 to 5 edges' middles."""


def _halved(pieces: Triangles, cut: NDArray[np.bool_]) -> tuple[Triangles, NDArray[np.intp]]:
    """Cut those edges of each triangle that are told, (n, 3); returns also of which triangle each piece is."""
    # Turned so that the first edge is cut and the last one, unless all are, is not.
    turn = np.select([cut.all(axis=1), cut[:, 0] & ~cut[:, 2], cut[:, 1] & ~cut[:, 0]], [0, 0, 1], 2)
    order = (turn[:, None] + np.arange(3)) % 3
    count = cut.sum(axis=1)
    found, of = [], []
    for edges, layout in _PIECES.items():
        these, fans, arrays = np.flatnonzero(count == edges), np.array(layout), []
        for values in (pieces.corners, pieces.normals, pieces.uv):
            turned = np.take_along_axis(values[these], order[these, :, None], axis=1)
            points = np.concatenate([turned, (turned + np.roll(turned, -1, axis=1)) / 2], axis=1)
            arrays.append(points[:, fans].reshape(-1, 3, values.shape[2]))
        found.append(Triangles(*arrays))
        of.append(np.repeat(these, len(layout)))
    return Triangles.joined(found), np.concatenate(of)
