"""Meshes made of flat facets, each with its place on a picture."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.parts.site import SEEN, Site


@dataclass(frozen=True, slots=True)
class Facets:
    """``points`` (n, 3) [m], ``uv`` (n, 2) on a picture whose lower left corner is (0, 0), ``triangles`` (m, 3).

    Triangles run counter-clockwise as seen from outside. ``normals`` (n, 3) where light is to fall otherwise than on
    the facets themselves.
    """

    points: Floats
    uv: Floats
    triangles: NDArray[np.int64]
    normals: Floats | None = None

    def mirrored(self) -> "Facets":
        """Return their mirror image across the xz plane, facing outwards again."""
        across = np.array([1.0, -1.0, 1.0])
        normals = None if self.normals is None else self.normals * across
        return Facets(self.points * across, self.uv, self.triangles[:, ::-1], normals)


def joined(parts: Iterable[Facets]) -> Facets:
    """Return several meshes as one. Raises ``ValueError`` where some have normals and others none."""
    parts = list(parts)
    normals = [p.normals for p in parts if p.normals is not None]
    if len(normals) not in (0, len(parts)):
        raise ValueError(f"{len(normals)} of {len(parts)} meshes have normals; valid is all of them, or none")
    starts = np.cumsum([0, *(len(p.points) for p in parts)])
    return Facets(
        np.concatenate([p.points for p in parts]),
        np.concatenate([p.uv for p in parts]),
        np.concatenate([p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)]),
        np.concatenate(normals) if normals else None,
    )


def quad(corners: ArrayLike, box: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)) -> Facets:
    """Return a flat facet with four ``corners`` (4, 3), counter-clockwise from the picture's lower left.

    ``box`` is the part of the picture that it shows: left, bottom, right, top.
    """
    left, bottom, right, top = box
    uv = np.array([(left, bottom), (right, bottom), (right, top), (left, top)])
    return Facets(np.array(corners, dtype=float), uv, np.array([(0, 1, 2), (0, 2, 3)]))


def fan(rim: ArrayLike, uv: ArrayLike) -> Facets:
    """Return a convex facet inside its ``rim`` (n, 3), counter-clockwise; ``uv`` (n, 2)."""
    rim, uv = np.asarray(rim, dtype=float), np.asarray(uv, dtype=float)
    n = len(rim)
    around = np.stack([np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n], axis=1)
    return Facets(np.vstack([rim.mean(axis=0), rim]), np.vstack([uv.mean(axis=0), uv]), around)


def grid(points: Floats, uv: Floats) -> Facets:
    """Return the sheet through ``points`` (rows, columns, 3), seen from where rows run up and columns to the right."""
    rows, columns = points.shape[:2]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij"))
    a = i * columns + j
    b, c, d = a + 1, a + columns + 1, a + columns
    triangles = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)
    return Facets(points.reshape(-1, 3), uv.reshape(-1, 2), triangles)


def add_mesh(site: Site, name: str, facets: Facets) -> str:
    """Add them to the world's meshes, to be shown by any number of geoms."""
    corners, arrays = facets.triangles.ravel(), {}
    if facets.normals is not None:
        arrays = {"usernormal": facets.normals.ravel(), "userfacenormal": corners}
    site.mesh(
        name,
        uservert=facets.points.ravel(),
        userface=corners,
        usertexcoord=(facets.uv * [1.0, -1.0] + [0.0, 1.0]).ravel(),  # MuJoCo counts from the upper edge
        userfacetexcoord=corners,
        **arrays,
    )
    return name


def show(site: Site, name: str, facets: Facets, material: str, cast: bool) -> None:
    """Add them to the world, for cameras only."""
    site.meshed(name, add_mesh(site, name, facets), material, SEEN, castshadow=cast)
