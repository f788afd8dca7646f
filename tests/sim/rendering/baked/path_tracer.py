"""Pictures of a world by paths of light, one by one: slow, noisy, and right in the mean.

An oracle for renderers. It knows the same sources and the same surfaces as they do, and shares none of their shortcuts:
no points between which light is linear, no shadow maps, no limit to what reflects how often but ``REFLECTIONS``.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.rendering.baked.model_lights import sun_of
from refseq_bench.sim.rendering.baked.surfaces import picture_of, surfaces_of
from refseq_bench.worlds.build import World
from refseq_bench.worlds.lighting.occluders import AWAY, Occluders
from refseq_bench.worlds.lighting.photometry import outlook, sources

Floats = NDArray[np.float64]
REFLECTIONS = 10
WHOLE = 1e3
"""Nothing is cut into pieces: no surface is so long [m]."""


@dataclass(frozen=True)
class Panels:
    """Luminous rectangles by a ``corner`` (n, 3) and ``sides`` (n, 2, 3) [m]; a ``lamp`` shines to one side alone.

    Their luminance is ``above`` (n,) for who looks up to them, else ``below`` (n,) [cd/m²].
    """

    corner: Floats
    sides: Floats
    above: Floats
    below: Floats
    lamp: NDArray[np.bool_]

    @classmethod
    def of(cls, world: World) -> "Panels":
        if world.plan.ceiling is None:
            return cls(np.zeros((0, 3)), np.zeros((0, 2, 3)), np.zeros(0), np.zeros(0), np.zeros(0, bool))
        lit = sources(world.plan, world.photometry)
        quads = np.concatenate([lit.windows.corners, lit.lamps.corners])
        lamps = lit.lamp_luminances[:, 1]
        return cls(
            quads[:, 0],
            np.stack([quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]], axis=1),
            np.concatenate([lit.above, lamps]),
            np.concatenate([lit.below, lamps]),
            np.arange(len(quads)) >= len(lit.windows),
        )


class PathTracer:
    """Traces light through a world and what stands still of a model in it."""

    def __init__(
        self, world: World, model: mujoco.MjModel, sky: float | None = None, ground: float | None = None
    ) -> None:
        surfaces = surfaces_of(model, WHOLE)
        self._shown = surfaces.still
        self._surfaces, self._model = surfaces, model
        self._triangles = surfaces.triangles[self._shown]
        self._geom = surfaces.geom[self._shown]
        self._glows = np.array([finish.emission > 0.0 for finish in surfaces.finish])[self._geom]
        corners = self._triangles.corners
        self._normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._normals /= np.maximum(np.linalg.norm(self._normals, axis=1, keepdims=True), 1e-12)
        self._all = Occluders(corners)
        self._matt = np.flatnonzero(~self._glows)
        self._opaque = Occluders(corners[self._matt])
        self._panels, self._sun = Panels.of(world), sun_of(model)
        above, below = (0.0, 0.0) if world.plan.ceiling is not None else outlook(world.plan, world.photometry.outdoors)
        self._sky, self._ground = above if sky is None else sky, below if ground is None else ground
        self._pictures = {t: picture_of(model, t) for t in {f.texture for f in surfaces.finish} - {-1}}

    def picture(self, seen: mujoco.MjvGLCamera, width: int, height: int, samples: int, seed: int = 0) -> Floats:
        """Luminance of a picture, (height, width) [cd/m²], the mean of so many paths a pixel."""
        rng, total = np.random.default_rng(seed), np.zeros(width * height)
        for _ in range(samples):
            total += self._sample(seen, width, height, rng)
        return (total / samples).reshape(height, width)

    def glows(self, seen: mujoco.MjvGLCamera, width: int, height: int) -> NDArray[np.bool_]:
        """Tell which pixels show a source itself, or nothing, (height, width)."""
        origins, ways = _rays(seen, width, height, np.full((width * height, 2), 0.5))
        met = self._all.hit(origins, ways)
        return ((met < 0) | self._glows[met]).reshape(height, width)

    def _sample(self, seen: mujoco.MjvGLCamera, width: int, height: int, rng: np.random.Generator) -> Floats:
        origins, ways = _rays(seen, width, height, rng.uniform(size=(width * height, 2)))
        found, carried = np.zeros(len(origins)), np.ones(len(origins))
        live, met = np.arange(len(origins)), self._all.hit(origins, ways)
        found += self._emitted(origins, ways, met)
        for bounce in range(REFLECTIONS):
            if bounce:
                hit = self._opaque.hit(origins, ways)
                met = np.where(hit < 0, -1, self._matt[hit])
                found[live] += carried[live] * self._far(ways, met)
            on = (met >= 0) & ~self._glows[met]
            live, origins, ways, met = live[on], origins[on], ways[on], met[on]
            if not len(live):
                break
            points, normals = self._met(origins, ways, met)
            carried[live] *= self._albedo(points, met)
            found[live] += carried[live] / np.pi * self._lit(points, normals, rng)
            origins, ways = points + AWAY * normals, _about(normals, rng)
        return found

    def _emitted(self, origins: Floats, ways: Floats, met: NDArray[np.int32]) -> Floats:
        """Luminance of sources that the camera sees itself."""
        shown = np.flatnonzero((met >= 0) & self._glows[met])
        found = self._far(ways, met)
        points, _ = self._met(origins[shown], ways[shown], met[shown])
        emission = np.array([finish.emission for finish in self._surfaces.finish])
        found[shown] = emission[self._geom[met[shown]]] * self._look(points, met[shown])
        return found

    def _far(self, ways: Floats, met: NDArray[np.int32]) -> Floats:
        return np.where(met < 0, np.where(ways[:, 2] > 0.0, self._sky, self._ground), 0.0)

    def _met(self, origins: Floats, ways: Floats, met: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Where rays meet their triangles, and the triangles' normals on that side."""
        normals = self._normals[met]
        across = np.einsum("mc,mc->m", ways, normals)
        normals = np.where(across[:, None] > 0.0, -normals, normals)
        reach = np.einsum("mc,mc->m", self._triangles.corners[met, 0] - origins, normals)
        return origins + ways * (reach / np.minimum(-np.abs(across), -1e-12))[:, None], normals

    def _albedo(self, points: Floats, met: NDArray[np.int32]) -> Floats:
        albedo = np.array([finish.albedo for finish in self._surfaces.finish])
        return albedo[self._geom[met]] * self._look(points, met)

    def _look(self, points: Floats, met: NDArray[np.int32]) -> Floats:
        """Share that the picture on a triangle sends back at a point."""
        corners, uv = self._triangles.corners[met], self._triangles.uv[met]
        a, b, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
        aa, ab, bb = (np.einsum("mc,mc->m", *pair) for pair in ((a, a), (a, b), (b, b)))
        pa, pb = np.einsum("mc,mc->m", p, a), np.einsum("mc,mc->m", p, b)
        scale = np.maximum(aa * bb - ab * ab, 1e-18)
        v, w = (bb * pa - ab * pb) / scale, (aa * pb - ab * pa) / scale
        at = uv[:, 0] + v[:, None] * (uv[:, 1] - uv[:, 0]) + w[:, None] * (uv[:, 2] - uv[:, 0])
        found = np.ones(len(met))
        textures = np.array([finish.texture for finish in self._surfaces.finish])[self._geom[met]]
        for texture, picture in self._pictures.items():
            of = np.flatnonzero(textures == texture)
            rows, columns = (np.floor(at[of, axis] % 1.0 * picture.shape[1 - axis]).astype(int) for axis in (1, 0))
            found[of] = picture[np.minimum(rows, len(picture) - 1), np.minimum(columns, picture.shape[1] - 1)]
        return found

    def _lit(self, points: Floats, normals: Floats, rng: np.random.Generator) -> Floats:
        """Illuminance straight from the sun, and from one point of one panel that stands for all [lx]."""
        off = points + AWAY * normals
        lux = np.zeros(len(points))
        facing = np.maximum(0.0, normals @ self._sun.towards) * self._sun.lux
        sunny = np.flatnonzero(facing)
        lux[sunny] = facing[sunny] * self._opaque.open_to(off[sunny], self._sun.towards)
        panels = self._panels
        if not len(panels.corner):
            return lux
        areas = np.linalg.norm(np.cross(panels.sides[:, 0], panels.sides[:, 1]), axis=1)
        chance = areas * (panels.above + panels.below)
        chance /= chance.sum()
        which = rng.choice(len(chance), len(points), p=chance)
        at = rng.uniform(size=(2, len(points), 1))
        targets = panels.corner[which] + at[0] * panels.sides[which, 0] + at[1] * panels.sides[which, 1]
        ways = targets - off
        square = np.einsum("mc,mc->m", ways, ways)
        across = np.cross(panels.sides[which, 0], panels.sides[which, 1]) / areas[which, None]
        theirs = np.einsum("mc,mc->m", ways, across)
        theirs = np.where(panels.lamp[which], np.maximum(-theirs, 0.0), np.abs(theirs))  # a lamp shines down alone
        ours = np.maximum(0.0, np.einsum("mc,mc->m", ways, normals))
        luminance = np.where(ways[:, 2] > 0.0, panels.above[which], panels.below[which])
        given = luminance * ours * theirs / square**2 * areas[which] / chance[which]
        worth = np.flatnonzero(given)
        lux[worth] += given[worth] * self._opaque.clear(off[worth], targets[worth])
        return lux


def _rays(seen: mujoco.MjvGLCamera, width: int, height: int, within: Floats) -> tuple[Floats, Floats]:
    """Rays through points ``within`` (n, 2) each pixel, row by row: where they begin, and unit vectors."""
    half = seen.frustum_width or width / height * (seen.frustum_top - seen.frustum_bottom) / 2
    row, column = np.divmod(np.arange(width * height), width)
    x = seen.frustum_center + half * (2 * (column + within[:, 0]) / width - 1)
    y = seen.frustum_top + (seen.frustum_bottom - seen.frustum_top) * (row + within[:, 1]) / height
    forward, up = np.array(seen.forward, float), np.array(seen.up, float)
    right = np.cross(forward, up)
    ways = seen.frustum_near * forward + x[:, None] * right + y[:, None] * up
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return np.broadcast_to(np.array(seen.pos, float), ways.shape), ways


def _about(normals: Floats, rng: np.random.Generator) -> Floats:
    """Directions by the cosine of their angle to a normal: a normal and a point of the unit sphere."""
    sphere = rng.normal(size=normals.shape)
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    ways = normals + 0.999 * sphere
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)
