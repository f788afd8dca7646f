"""Cast rays at the few geoms that they may meet, for the very hits that a cast at all geoms of a model finds.

``mj_multiRay`` looks at each geom of a model for each ray, for some two nanoseconds: among hundreds of geoms nearly all
that a ray costs. Here each bundle of rays is first held against the geoms' bounding boxes, and only the geoms that it
may meet are handed on, in the same order.
"""

import copy
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

MARGIN = 1e-6
"""Boxes and bundles are taken for so much wider [m], far above what rounding does to them in a world of kilometres."""
NARROW = 0.1
"""A bundle all of whose rays look so much ahead, as a cosine, has planes that bound it."""


@dataclass(frozen=True, slots=True)
class SceneHits:
    """First hits of rays in bundles, each (bundles, rays), ``normal`` (bundles, rays, 3) in the world's axes.

    ``distance`` [m] is infinite, ``geom`` −1 and ``normal`` 0 where nothing is met.
    """

    distance: NDArray[np.float64]
    geom: NDArray[np.int32]
    normal: NDArray[np.float64]


FEW = 120_000
"""Up to so many pairs of a ray and a geom it takes longer to sort out who may meet whom than to cast."""


class RayScene:
    """The geoms of ``model`` where they were at the last ``look``; they may move, but stay as they are.

    Rays are cast in a copy of the model, whose world's body is given those geoms alone that a bundle may meet.
    """

    def __init__(self, model: mujoco.MjModel, few: int = FEW) -> None:
        self.model, self._few = model, few
        self._known: dict[tuple[bytes, int], _Kinds] = {}

    @cached_property
    def _slots(self) -> "_Slots":
        return _Slots(self.model)

    def look(self, data: mujoco.MjData, groups: NDArray[np.uint8], blind_body: int) -> None:
        """Take the geoms of ``groups`` where they are in ``data``, without those of one body."""
        self._data, self._groups, self._blind_body, self._placed = data, groups, blind_body, False
        key = groups.tobytes(), blind_body
        if key not in self._known:
            self._known[key] = _Kinds.of(self.model, groups, blind_body)
        self._met = self._known[key]

    def _place(self) -> None:
        """Take their boxes, at the first cast that needs them."""
        if self._placed:
            return
        self._placed, met, data = True, self._met, self._data
        self._at, self._turned = data.geom_xpos[met.ids], data.geom_xmat[met.ids]
        axes = self._turned.reshape(-1, 3, 3)
        self._middles = self._at + (axes @ met.middles[:, :, None])[:, :, 0]
        self._spans = np.ascontiguousarray((axes * met.halves[:, None]).transpose(2, 0, 1)).reshape(-1, 3)

    def cast(
        self,
        origins: NDArray[np.float64],
        rays: NDArray[np.float64],
        reach: float,
        facing: NDArray[np.float64] | None = None,
    ) -> SceneHits:
        """Cast unit vectors ``rays`` (bundles, rays, 3) from ``origins`` (bundles, 3) [m], as far as ``reach`` [m].

        Who knows the planes that bound the bundles gives them, see ``bounding_planes``.
        """
        shape = rays.shape[:2]
        distance, geom, normal = np.full(shape, np.inf), np.full(shape, -1, np.int32), np.zeros(rays.shape)
        if not len(self._met.ids) or not rays.size:
            return SceneHits(distance, geom, normal)
        if rays.size // 3 * self.model.ngeom <= self._few:
            return self._cast_at_all(origins, rays, reach)
        self._place()
        for bundle, may_meet in enumerate(
            self._may_meet(origins, bounding_planes(rays) if facing is None else facing, reach)
        ):
            (near,) = may_meet.nonzero()
            if len(near):
                self._slots.put(self._met, near, self._at[near], self._turned[near])
                self._slots.cast(origins[bundle], rays[bundle], reach, distance[bundle], geom[bundle], normal[bundle])
                geom[bundle] = np.where(geom[bundle] >= 0, self._met.ids[near][geom[bundle]], -1)
        return _within(reach, SceneHits(distance, geom, normal))

    def _cast_at_all(self, origins: NDArray[np.float64], rays: NDArray[np.float64], reach: float) -> SceneHits:
        shape = rays.shape[:2]
        distance, geom, normal = np.empty(shape), np.empty(shape, np.int32), np.zeros(rays.shape)
        model, data, groups, blind = self.model, self._data, self._groups, self._blind_body
        for bundle, origin in enumerate(origins):
            aims, facing = rays[bundle].reshape(-1), normal[bundle].reshape(-1)
            out = geom[bundle], distance[bundle], facing
            mujoco.mj_multiRay(model, data, origin, aims, groups, True, blind, *out, shape[1], reach)
        return _within(reach, SceneHits(distance, geom, normal))

    def _may_meet(self, origins: NDArray[np.float64], facing: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
        """Geoms that a bundle may meet, (bundles, geoms): all that it meets, and a few more.

        No ray of a bundle goes back behind one of its planes through the origin. So none meets a box that lies there
        wholly: whose outermost point along the plane's direction, which ``facing`` has, comes before the origin.
        """
        bundles, geoms = len(origins), len(self._middles)
        normals = facing.reshape(-1, 3).T
        out = np.abs(self._spans @ normals).reshape(3, geoms, normals.shape[1]).sum(axis=0) + self._middles @ normals
        ends = out.reshape(geoms, bundles, -1) - np.einsum("bx,bpx->bp", origins, facing)
        away = np.sqrt(((self._middles[:, None] - origins) ** 2).sum(axis=2))  # (geoms, bundles)
        meets = (ends.min(axis=2) >= -MARGIN) & (away - self._met.radii[:, None] <= reach)
        return np.asarray((meets | self._met.boundless[:, None]).T)


class _Slots:
    """A copy of a model whose geoms are other ones for each cast: so many of the first ones as the world's body has."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = copied = copy.copy(model)
        self._data = mujoco.MjData(copied)
        copied.body_geomnum[:], copied.body_bvhadr[:] = 0, -1
        # All belong to the world, are seen, and have no bounding sphere: what these leave out is left out before.
        copied.geom_bodyid[:], copied.geom_rbound[:], copied.geom_matid[:], copied.geom_rgba[:] = 0, 0.0, -1, 1.0
        # Views, since to look up an attribute of a model costs as much as to copy a few rows.
        self._count, self._kinds, self._meshes = copied.body_geomnum, copied.geom_type, copied.geom_dataid
        self._sizes, self._at, self._turned = copied.geom_size, self._data.geom_xpos, self._data.geom_xmat

    def put(self, met: "_Kinds", near: NDArray[np.intp], at: NDArray[np.float64], turned: NDArray[np.float64]) -> None:
        """Have these geoms alone, in places (geoms, 3) [m] and turned by matrices (geoms, 9)."""
        self._count[0] = count = len(near)
        self._kinds[:count], self._meshes[:count], self._sizes[:count] = (
            met.kinds[near],
            met.meshes[near],
            met.sizes[near],
        )
        self._at[:count], self._turned[:count] = at, turned

    def cast(
        self,
        origin: NDArray[np.float64],
        rays: NDArray[np.float64],
        reach: float,
        distance: NDArray[np.float64],
        slot: NDArray[np.int32],
        normal: NDArray[np.float64],
    ) -> None:
        """Fill in what ``rays`` (rays, 3) meet first: ``distance`` [m] and ``slot`` (rays,), ``normal`` as rays."""
        aims, facing, all_groups, no_body = rays.reshape(-1), normal.reshape(-1), None, -1
        mujoco.mj_multiRay(
            self._model, self._data, origin, aims, all_groups, True, no_body, slot, distance, facing, len(rays), reach
        )


@dataclass(frozen=True, slots=True)
class _Kinds:
    """Geoms that rays of some groups may meet, as the model has them; of boxes in each geom's own frame [m]."""

    ids: NDArray[np.int32]
    kinds: NDArray[np.int32]
    meshes: NDArray[np.int32]
    sizes: NDArray[np.float64]
    middles: NDArray[np.float64]
    halves: NDArray[np.float64]
    radii: NDArray[np.float64]
    boundless: NDArray[np.bool_]

    @classmethod
    def of(cls, model: mujoco.MjModel, groups: NDArray[np.uint8], blind_body: int) -> "_Kinds":
        opacity, painted = model.geom_rgba[:, 3].copy(), model.geom_matid >= 0
        opacity[painted] = model.mat_rgba[model.geom_matid[painted], 3]
        met = (groups[model.geom_group] != 0) & (model.geom_bodyid != blind_body) & (opacity > 0)
        ids = np.flatnonzero(met).astype(np.int32)
        kinds, box = model.geom_type[ids], model.geom_aabb[ids]
        plain = (kinds == mujoco.mjtGeom.mjGEOM_PLANE) | (kinds == mujoco.mjtGeom.mjGEOM_HFIELD)
        halves = np.where(plain[:, None], 0.0, box[:, 3:])
        radii = np.sqrt((halves**2).sum(axis=1)) + MARGIN
        return cls(ids, kinds, model.geom_dataid[ids], model.geom_size[ids], box[:, :3], halves, radii, plain)


def _within(reach: float, hits: SceneHits) -> SceneHits:
    """The hits up to ``reach`` [m]: a wide geom may begin before it, and be met behind it."""
    beyond = (hits.geom < 0) | (hits.distance > reach)
    hits.distance[beyond], hits.geom[beyond], hits.normal[beyond] = np.inf, -1, 0.0
    return hits


def bounding_planes(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions (bundles, 4, 3) along which no unit vector of ``rays`` (bundles, rays, 3) goes back, but by rounding.

    They stand on the planes through the outermost rays to either side of a bundle's middle, above it and below. A
    bundle that looks about itself has none: its directions are 0.
    """
    across = rays.transpose(0, 2, 1)
    ahead = (across @ np.ones((rays.shape[1], 1)))[:, :, 0]
    ahead /= np.sqrt((ahead * ahead).sum(axis=1, keepdims=True)) + 1e-300
    x, y, z = ahead.T
    axes = np.stack([-y, x, np.zeros_like(x), -z * x, -z * y, x * x + y * y], axis=1).reshape(-1, 2, 3)  # aside and up
    forward, seen = (ahead[:, None] @ across), axes @ across  # (bundles, 1, rays), (bundles, 2, rays)
    narrow = forward.min(axis=2, keepdims=True) > NARROW
    slopes = seen / np.where(narrow, forward, 1.0)
    low, high = slopes.min(axis=2, keepdims=True), slopes.max(axis=2, keepdims=True)
    facing = np.concatenate([axes - low * ahead[:, None], high * ahead[:, None] - axes], axis=1)
    return np.asarray(np.where(narrow, facing, 0.0))
