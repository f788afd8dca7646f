"""What an ultrasonic ranger hears: where sound that it sends into a cone is thrown back to it.

Walls are mirrors for sound of 7 mm wavelength. A smooth one answers from the foot of the perpendicular on it, and two
that meet at a right angle answer from their edge, as far off the axis as the side lobes reach: ±42° for walls (facts).
What is small or round answers from any point that the nominal cone of ±15° meets, unless it is slanted more than that.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.beams import GLASS_GROUPS, SEEN_GROUPS

NOMINAL, WIDEST = math.radians(15), math.radians(42)
"""Half the cone in which a ranger hears anything, and in which it hears walls [rad]."""
GROUPS = SEEN_GROUPS | GLASS_GROUPS
"""Geom groups that throw sound back: panes of glass are walls to it."""

INNER_RAYS, OUTER_RAYS = 36, 16
"""Rays in the nominal cone and around it: a choice. The inner ones are 4.5° apart, 0.8° as seen from above."""
SMOOTH = 0.02
"""Rays of one geom whose normals are alike within this meet one flat face; two make one."""
RIGHT_ANGLE = math.sin(math.radians(3))
"""Faces meet at a right angle if the cosine between them is smaller: a choice."""
NEAR = 0.01
"""What is met within this distance [m] of where a mirror point should be is that point."""


def _spiral(count: int, inner: float, outer: float) -> NDArray[np.float64]:
    """Directions that fill the ring between two angles [rad] off the x axis evenly, (count, 3): Vogel's spiral."""
    steps = np.arange(count) + 0.5
    cosines = math.cos(inner) + (math.cos(outer) - math.cos(inner)) * steps / count
    around = steps * math.pi * (3 - math.sqrt(5))
    sines = np.sqrt(1 - cosines**2)
    return np.stack([cosines, sines * np.cos(around), sines * np.sin(around)], axis=1)


RAYS = np.concatenate([_spiral(INNER_RAYS, 0.0, NOMINAL), _spiral(OUTER_RAYS, NOMINAL, WIDEST)])
"""Directions (rays, 3) in the ranger's frame, x along its axis."""


@dataclass(frozen=True, slots=True)
class Met:
    """What rays from one point meet: ``distance`` (rays,) [m], infinite for nothing, ``normal`` (rays, 3), ``geom``."""

    distance: NDArray[np.float64]
    normal: NDArray[np.float64]
    geom: NDArray[np.int32]


class Ears:
    """Rangers at ``sites`` of ``model`` that hear as far as ``reach`` [m], deaf to the body ``own`` they sit on."""

    def __init__(self, model: mujoco.MjModel, sites: tuple[str, ...], own: str, reach: float) -> None:
        self._model, self._reach = model, reach
        self._sites = [model.site(name).id for name in sites]
        self._own = model.body(own).id

    def between(self, data: mujoco.MjData, speaker: int, way: NDArray[np.float64], listener: int) -> float:
        """From the point at ``way`` (3,) [m] from one ranger, how far to another [m]; infinite outside its cone."""
        site = self._sites[listener]
        back = data.site_xpos[self._sites[speaker]] + way - data.site_xpos[site]
        length = math.sqrt(back @ back)
        return length if back @ data.site_xmat[site, ::3] >= math.cos(WIDEST) * length else math.inf

    def echo(self, data: mujoco.MjData, ranger: int) -> NDArray[np.float64] | None:
        """The way to the nearest point that throws sound back, (3,) [m] in the world's axes; None without an echo."""
        site = self._sites[ranger]
        origin, attitude = data.site_xpos[site], data.site_xmat[site].reshape(3, 3)
        axis, rays = attitude[:, 0], RAYS @ attitude.T
        met = self._meet(data, origin, rays)
        nearest = _any_point(met, rays, axis)
        mirrored = self._mirrored(data, origin, axis, met, rays)
        candidates = [way for way in (nearest, mirrored) if way is not None]
        return min(candidates, key=_length, default=None)

    def _mirrored(
        self,
        data: mujoco.MjData,
        origin: NDArray[np.float64],
        axis: NDArray[np.float64],
        met: Met,
        rays: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """The way to the nearest foot of a perpendicular, or edge of two walls, that is seen within the wide cone."""
        ways = mirror_points(met, rays)
        lengths = np.sqrt((ways * ways).sum(axis=1))
        ways = ways[(ways @ axis >= math.cos(WIDEST) * lengths) & (lengths > 0)]
        if not len(ways):
            return None
        lengths = np.sqrt((ways * ways).sum(axis=1))
        seen = np.abs(self._meet(data, origin, ways / lengths[:, None]).distance - lengths) < NEAR
        return ways[np.where(seen, lengths, np.inf).argmin()] if seen.any() else None

    def _meet(self, data: mujoco.MjData, origin: NDArray[np.float64], rays: NDArray[np.float64]) -> Met:
        count = len(rays)
        distance, normal, geom = np.empty(count), np.zeros((count, 3)), np.empty(count, np.int32)
        mujoco.mj_multiRay(
            self._model,
            data,
            origin,
            rays.ravel(),
            GROUPS,
            True,
            self._own,
            geom,
            distance,
            normal.reshape(-1),
            count,
            self._reach,
        )
        # MuJoCo leaves out geoms that begin beyond the reach; a wide one may begin before it and be met behind it.
        return Met(np.where((geom >= 0) & (distance <= self._reach), distance, np.inf), normal, geom)


def _any_point(met: Met, rays: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The way to the nearest point in the nominal cone whose surface is slanted to the axis by no more than a wall."""
    answers = -met.normal[:INNER_RAYS] @ axis >= math.cos(WIDEST)
    distance = np.where(answers, met.distance[:INNER_RAYS], np.inf)
    nearest = distance.argmin()
    return distance[nearest] * rays[nearest] if np.isfinite(distance[nearest]) else None


def mirror_points(met: Met, rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ways to where flat faces mirror sound straight back, (points, 3): feet of perpendiculars, corners' edges."""
    normals, heights, points = _faces(met, rays)
    return np.concatenate([-heights[:, None] * normals, _corner_edges(normals, heights, points)])


def _faces(met: Met, rays: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Normals (faces, 3), distances from the ranger [m] and a point each (faces, 3) of the flat faces that rays met."""
    hit = np.isfinite(met.distance)
    normals, points = met.normal[hit], met.distance[hit, None] * rays[hit]
    steps = np.round(normals / SMOOTH).astype(np.int64) + 50
    keys = ((met.geom[hit] * 128 + steps[:, 0]) * 128 + steps[:, 1]) * 128 + steps[:, 2]
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    flat = first[count > 1]
    normals, points = normals[flat], points[flat]
    return normals, -(normals * points).sum(axis=1), points


def _corner_edges(
    normals: NDArray[np.float64], heights: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Ways to the edges at which two faces meet at a right angle and look at each other, (edges, 3)."""
    cosine = normals @ normals.T
    before = points @ normals.T + heights > 0  # whether the point of a face lies before the plane of another
    one, other = np.nonzero(np.triu((np.abs(cosine) < RIGHT_ANGLE) & before & before.T))
    c = cosine[one, other]
    along_one, along_other = heights[one] - c * heights[other], heights[other] - c * heights[one]
    return -(along_one[:, None] * normals[one] + along_other[:, None] * normals[other]) / (1 - c * c)[:, None]


def _length(way: NDArray[np.float64]) -> float:
    return float(way @ way)
