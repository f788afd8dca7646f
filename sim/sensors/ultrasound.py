"""Echoes of an ultrasonic ranger: where sound that it sends into a cone is thrown back to it.

Walls are mirrors for sound of 7 mm wavelength. A smooth one answers from the foot of the perpendicular on it, and two
that meet at a right angle answer from their edge, as far off the axis as the side lobes reach: ±42° for walls (facts).
What is small or round answers from any point that the nominal cone of ±15° meets, unless it is slanted more than that.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.sensors.beams import GLASS_GROUPS, SEEN_GROUPS
from refseq_bench.sim.sensors.ray_scene import RayScene, bounding_planes

NOMINAL, WIDEST = math.radians(15), math.radians(42)
"""Half the cone in which a ranger hears anything, and in which it hears walls [rad]."""
GROUPS = SEEN_GROUPS | GLASS_GROUPS
"""Geom groups that throw sound back: panes of glass are walls to it."""

INNER_RAYS, OUTER_RAYS = 36, 16
"""Rays in the nominal cone and around it: a choice. The inner ones are 0.83° apart as seen from above."""
SMOOTH = 0.02
"""Rays of one geom whose normals are alike within this meet one flat face; two make one."""
RIGHT_ANGLE = math.sin(math.radians(3))
"""Faces meet at a right angle if the cosine between them is smaller: a choice."""
NEAR = 0.01
"""Hits within this distance [m] of where a mirror point should be are that point."""


GOLDEN = (math.sqrt(5) - 1) / 2
"""Its multiples, less whole numbers, spread over 0 to 1 as evenly as they can."""


def _fan(count: int, widest: float) -> NDArray[np.float64]:
    """Directions within an angle [rad] off the x axis, (count, 3): evenly apart as seen from above.

    What stands upright, a post or a leg, slips through no gap wider than the others.
    """
    steps = np.arange(count) + 0.5
    aside = widest * (2 * steps / count - 1)
    up = np.arccos(math.cos(widest) / np.cos(aside)) * (2 * (steps * GOLDEN % 1) - 1)
    return np.stack([np.cos(up) * np.cos(aside), np.cos(up) * np.sin(aside), np.sin(up)], axis=1)


def _spiral(count: int, inner: float, outer: float) -> NDArray[np.float64]:
    """Directions that fill the ring between two angles [rad] off the x axis evenly, (count, 3): Vogel's spiral."""
    steps = np.arange(count) + 0.5
    cosines = math.cos(inner) + (math.cos(outer) - math.cos(inner)) * steps / count
    around = steps * 2 * math.pi * GOLDEN
    sines = np.sqrt(1 - cosines**2)
    return np.stack([cosines, sines * np.cos(around), sines * np.sin(around)], axis=1)


RAYS = np.concatenate([_fan(INNER_RAYS, NOMINAL), _spiral(OUTER_RAYS, NOMINAL, WIDEST)])
"""Directions (rays, 3) in the ranger's frame, x along its axis."""
_BOUNDS = bounding_planes(RAYS[None])[0]
"""Directions (4, 3) in that frame along which none of them goes back."""


@dataclass(frozen=True, slots=True)
class RayHits:
    """Hits of each ranger's rays: ``distance`` [m], infinite for nothing, and ``geom`` (rangers, rays).

    ``normal`` and ``point``, seen from the ranger, are (rangers, rays, 3) in the world's axes [m].
    """

    distance: NDArray[np.float64]
    geom: NDArray[np.int32]
    normal: NDArray[np.float64]
    point: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FlatFaces:
    """Flat faces that rays met: whose rays (faces,), ``normal`` (faces, 3), ``height`` of the ranger above it [m].

    ``point`` (faces, 3) is one on it, as seen from the ranger [m].
    """

    ranger: NDArray[np.intp]
    normal: NDArray[np.float64]
    height: NDArray[np.float64]
    point: NDArray[np.float64]


class UltrasoundRangers:
    """Rangers at ``sites`` of a model that hear as far as ``reach`` [m], deaf to the body ``own`` they sit on."""

    def __init__(self, scene: RayScene, sites: tuple[str, ...], own: str, reach: float) -> None:
        model = scene.model
        self._scene, self._model, self._reach = scene, model, reach
        self._sight = reach / math.cos(WIDEST)  # rays ahead go so far to meet a wall of which the foot is in reach
        self._sites = np.array([model.site(name).id for name in sites], int)
        self._own = model.body(own).id

    def echoes(self, data: mujoco.MjData, rangers: NDArray[np.intp]) -> NDArray[np.float64]:
        """Ways to the nearest points that throw sound back to some ``rangers`` (n,).

        (n, 3) [m] in the world's axes, infinite where there is no echo.
        """
        sites = self._sites[rangers]
        origins, attitudes = data.site_xpos[sites], data.site_xmat[sites].reshape(-1, 3, 3)
        axes, turns = attitudes[:, :, 0], attitudes.transpose(0, 2, 1)
        met = self._meet(data, origins, RAYS @ turns, _BOUNDS @ turns)
        anywhere, ways = _any_points(met, axes, self._reach)
        owner, mirrors = self._mirrors(data, origins, axes, met, anywhere)
        for ranger, way in zip(owner.tolist(), mirrors, strict=True):
            if (length := math.sqrt(way @ way)) < anywhere[ranger]:
                anywhere[ranger], ways[ranger] = length, way
        return ways

    def between(
        self, data: mujoco.MjData, speakers: NDArray[np.intp], ways: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Distances from the points at ``ways`` (n, 3) [m] from ``speakers`` (n,) to each of them.

        (points, rangers) [m], infinite where a point is outside a ranger's cone.
        """
        sites = self._sites[speakers]
        points, places, axes = data.site_xpos[sites] + ways, data.site_xpos[sites], data.site_xmat[sites, ::3]
        back = points[:, None] - places
        length = np.linalg.norm(back, axis=2)
        return np.where((back * axes).sum(axis=2) >= math.cos(WIDEST) * length, length, math.inf)

    def _meet(
        self,
        data: mujoco.MjData,
        origins: NDArray[np.float64],
        rays: NDArray[np.float64],
        facing: NDArray[np.float64],
    ) -> RayHits:
        self._scene.look(data, GROUPS, self._own)
        met = self._scene.cast(origins, rays, self._sight, facing)
        near = np.where(np.isfinite(met.distance), met.distance, 0.0)
        return RayHits(met.distance, met.geom, met.normal, near[:, :, None] * rays)

    def _mirrors(
        self,
        data: mujoco.MjData,
        origins: NDArray[np.float64],
        axes: NDArray[np.float64],
        met: RayHits,
        nearer: NDArray[np.float64],
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Whose they are (points,), and ways (points, 3) [m] to the mirror points that are seen in the wide cone.

        Those that are not ``nearer`` (rangers,) [m] than what was heard already are not looked for.
        """
        owner, ways = mirror_points(faces_of(met))
        length = np.sqrt((ways * ways).sum(axis=1))
        ahead = (ways * axes[owner]).sum(axis=1) >= math.cos(WIDEST) * length
        within = ahead & (length > 0) & (length <= self._reach) & (length < nearer[owner] + NEAR)
        owner, ways, length = owner[within], ways[within], length[within]
        rays, geom = ways / length[:, None], np.empty(1, np.int32)
        # So few rays are cast sooner one by one.
        distance = np.array(
            [
                mujoco.mj_ray(self._model, data, origins[ranger], ray, GROUPS, True, self._own, geom)
                for ranger, ray in zip(owner.tolist(), rays, strict=True)
            ]
        )
        seen = np.abs(distance - length) < NEAR
        return owner[seen], (rays * distance[:, None])[seen]


def _any_points(
    met: RayHits, axes: NDArray[np.float64], reach: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance (rangers,) [m] of the nearest points in the nominal cones that answer, and the way there (rangers, 3).

    All within ``reach`` [m] do whose surface is slanted to the axis by no more than a wall may be.
    """
    slant = -(met.normal[:, :INNER_RAYS] @ axes[:, :, None])[:, :, 0]
    distance = met.distance[:, :INNER_RAYS]
    distance = np.where((slant >= math.cos(WIDEST)) & (distance <= reach), distance, math.inf)
    every, nearest = np.arange(len(axes)), distance.argmin(axis=1)
    far = distance[every, nearest]
    return far, np.where(np.isfinite(far)[:, None], met.point[every, nearest], math.inf)


def faces_of(met: RayHits) -> FlatFaces:
    """Flat faces: those of one geom on which two rays or more meet the same normal."""
    (hits,) = np.isfinite(met.distance).ravel().nonzero()
    ranger = hits // met.distance.shape[1]
    normal = met.normal.reshape(-1, 3).take(hits, axis=0)
    steps = np.rint(normal / SMOOTH).astype(np.int64) + 64
    key = (ranger * 2**24 + met.geom.ravel().take(hits)) * 128**3 + steps @ _DIGITS
    order = key.argsort(kind="stable")
    same = key[order[1:]] == key[order[:-1]]
    first = same.copy()
    first[1:] &= ~same[:-1]
    pairs = np.flatnonzero(first)  # the first two of each run
    flat = order[pairs]
    ranger, normal, point = ranger[flat], normal[flat], met.point.reshape(-1, 3)[hits[flat]]
    return FlatFaces(ranger, normal, -(normal * point).sum(axis=1), point)


_DIGITS = np.array([128**2, 128, 1])


def mirror_points(faces: FlatFaces) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Points where flat faces mirror sound straight back: whose each is (points,), and the way to it (points, 3) [m].

    These are the feet of perpendiculars, and the nearest points of corners.
    """
    corner_of, corners = _corners(faces)
    return np.concatenate([faces.ranger, corner_of]), np.concatenate([-faces.height[:, None] * faces.normal, corners])


def _corners(faces: FlatFaces) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Edges of faces that meet at a right angle and look at each other: whose, and ways to their nearest points."""
    cosine = faces.normal @ faces.normal.T
    before = faces.point @ faces.normal.T + faces.height > 0  # whether a face's point lies before another's plane
    same = faces.ranger[:, None] == faces.ranger
    one, other = np.nonzero(same & (np.abs(cosine) < RIGHT_ANGLE) & before & before.T)
    once = one < other
    one, other = one[once], other[once]
    c = cosine[one, other]
    by_one, by_other = faces.height[one] - c * faces.height[other], faces.height[other] - c * faces.height[one]
    ways = by_one[:, None] * faces.normal[one] + by_other[:, None] * faces.normal[other]
    return faces.ranger[one], -ways / (1 - c * c)[:, None]
