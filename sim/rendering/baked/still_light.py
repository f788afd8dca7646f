"""Light on what stands still, and around what moves, the direct sun apart."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.rows import distinct_rows
from refseq_bench.sim.rendering.baked.charts import MARGIN, Chart
from refseq_bench.sim.rendering.baked.surfaces import Surfaces, moves, picture_of
from refseq_bench.sim.rendering.baked.triangles import Floats, Triangles, distinct
from refseq_bench.worlds.lighting.ambient import AXES, EYE
from refseq_bench.worlds.lighting.baking import Baked, Shell
from refseq_bench.worlds.lighting.form_factors import Cards

if TYPE_CHECKING:  # slow to import, and the bench drives without pictures too
    from scipy.spatial import cKDTree

Bake = Callable[[Shell, Cards], Baked]
"""Works out the light but the direct sun's on a shell and on other cards."""
PROBE_STEP = 1.5
"""Light around what moves is known at places so far apart [m]: a choice."""
NEIGHBOURS = 4
"""It is the mean of so many of them, by how near they are."""
LEVEL = 0.9
"""A surface is ground to stand on where its normal's upward part is at least this."""
CLOSE, TURNED = 0.4, 0.5
"""Corners that are on no chart share their light within cells so wide [m], where normals are alike to so much."""


@dataclass(frozen=True, slots=True)
class Probes:
    """Light on cards that face along the six axes, ``lux`` (n, 6) [lx], at ``points`` (n, 3) [m]."""

    points: Floats
    lux: Floats
    tree: "cKDTree"

    def at(self, place: Floats) -> Floats:
        """Return the light at a place (3,), (6,) [lx]."""
        apart, which = self.tree.query(place, k=[*range(1, min(NEIGHBOURS, len(self.points)) + 1)])
        weights = 1.0 / (apart + 0.1)
        return np.asarray(weights @ self.lux[which] / weights.sum())


def on_cards(cube: Floats, normals: Floats) -> Floats:
    """Light on cards of ``normals`` (n, 3) where those along the axes get ``cube`` (6,), (n,) [lx]."""
    sides = np.where(normals >= 0.0, cube[0::2], cube[1::2])
    return np.asarray((normals**2 * sides).sum(axis=1))


@dataclass(frozen=True, slots=True)
class StillLight:
    """Light but the direct sun's: on the ``sheet`` (rows, columns), on ``corners`` (n, 3) of all triangles, and around.

    All in [lx]; corners that have their light on the sheet have 0.
    """

    sheet: NDArray[np.float32]
    corners: Floats
    probes: Probes


def light_still(model: mujoco.MjModel, surfaces: Surfaces, bake: Bake) -> StillLight:
    """Light all that stands still."""
    from scipy.spatial import cKDTree

    charts, loose = surfaces.sheet.charts, _loose(surfaces)
    single = surfaces.triangles[loose]
    first, index = _distinct(single)
    cards = _cards(charts, single, first)
    on_charts = len(cards) - len(first)
    albedo = _albedo(model, surfaces)
    cells, of = _cells(charts)
    shell = Shell(
        triangles=np.concatenate([_faces_in_cells(charts), single.corners]),
        albedo=albedo[np.concatenate([surfaces.sheet_geom[of], surfaces.geom[loose]])],
        cards=cards,
        corners=np.concatenate([cells, on_charts + index.reshape(-1, 3)]),
    )
    places = _probe_places(cards, *_firm(model))
    six = Cards(np.repeat(places, len(AXES), axis=0), np.tile(AXES, (len(places), 1)))
    found = bake(shell, six)
    corners = np.zeros((len(surfaces), 3))
    corners[loose] = _of_nearest(cards[on_charts:], found.lux[on_charts:], found.buried[on_charts:])[index].reshape(
        -1, 3
    )
    probes = Probes(places, found.around.reshape(-1, len(AXES)), cKDTree(places))
    return StillLight(_sheet(surfaces, found), corners, probes)


def _loose(surfaces: Surfaces) -> NDArray[np.intp]:
    """Triangles that are lit at their corners."""
    glows = np.array([finish.emission > 0.0 for finish in surfaces.finish])
    return np.flatnonzero(surfaces.still & ~surfaces.charted & ~glows[surfaces.geom])


def _distinct(triangles: Triangles) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of corners that lie or face apart, and which of these each corner is."""
    both = np.concatenate([triangles.corners / CLOSE, triangles.normals / TURNED], axis=2).reshape(-1, 6)
    return distinct(np.round(both).astype(np.int64).astype(np.uint64))


def _of_nearest(cards: Cards, lux: Floats, buried: NDArray[np.bool_]) -> Floats:
    """The light on cards, (n,) [lx]; one that is buried, as where a frame meets its wall, gets the nearest other's."""
    from scipy.spatial import cKDTree

    clear = np.flatnonzero(~buried)
    if not len(clear):
        return np.zeros(len(lux))
    places = np.concatenate([cards.points / CLOSE, cards.normals / TURNED], axis=1)
    _, nearest = cKDTree(places[clear]).query(places[buried])
    found = lux.copy()
    found[buried] = lux[clear[nearest]]
    return found


def _cards(charts: list[Chart], single: Triangles, first: NDArray[np.intp]) -> Cards:
    """The points of charts, one after another, and then the corners of single triangles."""
    points = [chart.points.reshape(-1, 3) for chart in charts]
    normals = [np.broadcast_to(chart.normal, part.shape) for chart, part in zip(charts, points, strict=True)]
    points.append(single.corners.reshape(-1, 3)[first])
    normals.append(single.normals.reshape(-1, 3)[first])
    return Cards(np.concatenate(points), np.concatenate(normals))


def _cells(charts: list[Chart]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Cells of all charts: which of their points are the corners, (n, 3), and which chart each is of, (n,)."""
    starts = np.cumsum([0] + [chart.points[..., 0].size for chart in charts])
    parts = [start + chart.cells for start, chart in zip(starts, charts, strict=False)]
    of = np.repeat(np.arange(len(charts)), [len(part) for part in parts])
    return np.concatenate([np.empty((0, 3), np.intp), *parts]), of


def _faces_in_cells(charts: list[Chart]) -> Floats:
    """Triangles that the cells of charts cover, whole faces to their edges, (n, 3, 3) [m]."""
    parts = [chart.whole.reshape(-1, 3)[chart.cells] for chart in charts]
    return np.concatenate([np.empty((0, 3, 3)), *parts])


def _sheet(surfaces: Surfaces, found: Baked) -> NDArray[np.float32]:
    """Put the light on the sheet; a buried point gets that of the nearest one of its chart that is not."""
    from scipy.ndimage import distance_transform_edt

    columns, rows = surfaces.sheet.size
    sheet, start = np.zeros((rows, columns), np.float32), 0
    for chart in surfaces.sheet.charts:
        part = slice(start, start := start + chart.points[..., 0].size)
        lux, buried = found.lux[part].reshape(chart.shape), found.buried[part].reshape(chart.shape)
        if buried.any() and not buried.all():
            nearest = distance_transform_edt(buried, return_distances=False, return_indices=True)
            lux = lux[tuple(nearest)]
        wide = np.pad(lux, MARGIN, mode="edge")
        top, left = chart.row - MARGIN, chart.column - MARGIN
        sheet[top : top + wide.shape[0], left : left + wide.shape[1]] = wide
    return sheet


def _albedo(model: mujoco.MjModel, surfaces: Surfaces) -> Floats:
    """Mean albedo of each geom with its picture, (ngeom,)."""
    means = {texture: picture_of(model, texture).mean() for texture in {f.texture for f in surfaces.finish} - {-1}}
    return np.array([finish.albedo * means.get(finish.texture, 1.0) for finish in surfaces.finish])


def _probe_places(cards: Cards, low: Floats, high: Floats) -> Floats:
    """Places above the ground from ``low`` to ``high`` (2,) [m], (n, 3) [m]; the middle of all where there is none."""
    within = ((cards.points[:, :2] >= low) & (cards.points[:, :2] <= high)).all(axis=1)
    ground = cards.points[within & (cards.normals[:, 2] > LEVEL)]
    if not len(ground):
        return cards.points.mean(axis=0, keepdims=True) if len(cards) else np.zeros((1, 3))
    cells = np.round(ground / PROBE_STEP).astype(int)
    first, _ = distinct_rows(cells)
    return np.asarray(ground[first] + [0.0, 0.0, EYE])


def _firm(model: mujoco.MjModel) -> tuple[Floats, Floats]:
    """The least and the most x and y of all that stands still and is touched, floors too, (2,) each [m].

    What moves keeps within: the land around a car park, which is looked at only, is five times as wide as the place.
    """
    rest = mujoco.MjData(model)
    mujoco.mj_kinematics(model, rest)
    touched = (model.geom_contype | model.geom_conaffinity) != 0
    firm = [geom for geom in np.flatnonzero(touched) if not moves(model, int(model.geom_bodyid[geom]))]
    if not firm:
        return np.full(2, -np.inf), np.full(2, np.inf)
    rotation = rest.geom_xmat[firm].reshape(-1, 3, 3)
    middle, half = model.geom_aabb[firm, :3].copy(), model.geom_aabb[firm, 3:].copy()
    # A plane is touched without end; it counts as wide as it is shown.
    planes = model.geom_type[firm] == mujoco.mjtGeom.mjGEOM_PLANE
    shown = model.geom_size[firm, :2]
    half[planes, :2] = np.where(shown > 0.0, shown, half[:, :2])[planes]
    middle[planes, 2] = half[planes, 2] = 0.0
    middle = rest.geom_xpos[firm] + np.einsum("gij,gj->gi", rotation, middle)
    half = np.einsum("gij,gj->gi", np.abs(rotation), half)
    return (middle - half)[:, :2].min(axis=0), (middle + half)[:, :2].max(axis=0)
