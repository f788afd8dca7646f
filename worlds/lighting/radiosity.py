"""Light between the walls: every patch of wall, floor and ceiling lights all others that it sees.

B = ρ (E + F B): what leaves a patch is its albedo times what falls on it, from the sources (E) and from the other
patches by the form factors F. All patches are matt. Furniture, posters and people are left out, open doors are as shut
ones.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.daylight import Daylight, sun_direction
from refseq_bench.worlds.lighting.form_factors import Cards, Quads, form_factors, pairs_in_sight, window_factor
from refseq_bench.worlds.lighting.photometry import FRAME_SHARE, Photometry, Sources, frame_face, sources
from refseq_bench.worlds.lighting.reflections import MOST, settled
from refseq_bench.worlds.lighting.sunlight import sunlit
from refseq_bench.worlds.plans.areas import enclosing, rectangles
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Door, FloorPlan, Wall, Window

PATCH = 1.0
"""Longest side of a patch [m]; a choice."""
WINDOW_ALBEDO = 0.09
"""Albedo of a window from inside: its frame, 0.15 of it, has albedo 0.6; the panes' own share is left out."""
SUN_SAMPLES = 4
"""Places along each side of a patch at which it is asked whether the sun falls there."""
SCALINGS = 20
"""Rounds of scaling the form factors; the sums are then right to 1e-6 and better."""


@dataclass(frozen=True, slots=True)
class SurfacePatches:
    """The room's surfaces in pieces: ``faces`` (n) and ``albedo`` (n,)."""

    faces: Quads
    albedo: Floats


@dataclass(frozen=True, slots=True)
class Interior:
    """A room in its light: what falls on its patches from the sources alone, and what leaves them.

    ``direct`` [lx] and ``exitance`` [lm/m²] are (n, 2): in lumens, and weighted with what a camera gathers.
    """

    plan: FloorPlan
    sources: Sources
    patches: SurfacePatches
    direct: Floats
    exitance: Floats

    def indirect(self, cards: Cards) -> Floats:
        """Return the light that the patches send onto cards, (m, 2) [lx].

        The view is filled to 1 where walls close it off: what is out of sight is like the rest.
        """
        shares = form_factors(cards, self.patches.faces, self.plan)
        seen = shares.sum(axis=1)
        full = np.where(seen > 0.0, seen, 1.0) if closed(self.plan) else np.maximum(seen, 1.0)
        return shares @ self.exitance / full[:, None]


def light_up(plan: FloorPlan, numbers: Photometry) -> Interior:
    """Solve the light between the walls of a plan with a ceiling."""
    patches, lit = lay_patches(plan), sources(plan, numbers)
    direct = _from_sources(plan, patches.faces, lit) + sun_on_faces(plan, patches.faces, numbers.outdoors)[:, None]
    return Interior(plan, lit, patches, direct, solve(patches.albedo, direct, exchange(patches.faces, plan)))


def closed(plan: FloorPlan) -> bool:
    """Tell whether walls close the room off all around."""
    return bool(enclosing(plan))


# --- patches ---


def lay_patches(plan: FloorPlan) -> SurfacePatches:
    """Cut floor, ceiling and the walls that reach it into patches of at most ``PATCH``."""
    laid = [part for area in rectangles(plan) for part in _levels(plan, area.low, area.size)]
    laid += [_on_wall(plan, wall) for wall in plan.full_walls]
    return SurfacePatches(Quads.joined([p.faces for p in laid]), np.concatenate([p.albedo for p in laid]))


def _levels(plan: FloorPlan, low: Floats, size: Floats) -> tuple[SurfacePatches, SurfacePatches]:
    """Lay patches on the floor, which look up, and on the ceiling above it, which look down."""
    x, y = np.array([size[0], 0.0, 0.0]), np.array([0.0, size[1], 0.0])
    m, n = _tiles(size)
    floor = Quads.tiled([*low, 0.0], x, y, (m, n))
    ceiling = Quads.tiled([*low, plan.roof.height], y, x, (n, m))
    return _plain(floor, _albedo(plan, plan.floor.material)), _plain(ceiling, _albedo(plan, plan.roof.material))


def _on_wall(plan: FloorPlan, wall: Wall) -> SurfacePatches:
    """Lay patches on a wall; doors and windows change their albedo by the share that they cover."""
    frame, size = LocalFrame.of(wall), (wall.length, plan.roof.height)
    m, n = _tiles(size)
    faces = frame_face(frame, (0.0, size[0]), (0.0, size[1]), (m, n))
    local = np.stack([(faces.centres[:, :2] - frame.origin) @ frame.along, faces.centres[:, 2]])
    half = np.array(size) / np.array([m, n]) / 2
    base = _albedo(plan, wall.material)
    albedo = np.full(len(faces), base)
    openings: tuple[Door | Window, ...] = (*plan.door, *plan.window)
    for item in (item for item in openings if item.wall == wall.name):
        own = _albedo(plan, item.material) if isinstance(item, Door) else WINDOW_ALBEDO
        covered = _overlap(local[0], half[0], item.extent) * _overlap(local[1], half[1], item.rise)
        albedo += covered * (own - base)
    return SurfacePatches(faces, albedo)


def _tiles(size: tuple[float, float] | Floats) -> tuple[int, int]:
    m, n = (max(1, int(np.ceil(side / PATCH - 1e-9))) for side in size)
    return m, n


def _overlap(middle: Floats, half: float, span: tuple[float, float]) -> Floats:
    """Share of each cell that lies in ``span``."""
    return np.clip(np.minimum(middle + half, span[1]) - np.maximum(middle - half, span[0]), 0.0, None) / (2 * half)


def _plain(faces: Quads, albedo: float) -> SurfacePatches:
    return SurfacePatches(faces, np.full(len(faces), albedo))


def _albedo(plan: FloorPlan, material: str) -> float:
    return plan.material[material].albedo


# --- light that comes straight from a source ---


def _from_sources(plan: FloorPlan, faces: Quads, lit: Sources) -> Floats:
    """Illuminance of patches by windows and lamps, (n, 2) [lx]; in a closed room all of each one's flux arrives."""
    cards = Cards(faces.centres, faces.normals)
    above, below = window_factors(cards, lit.windows, plan)
    lamps = form_factors(cards, lit.lamps, plan)
    if closed(plan):
        half = lit.windows.areas / 2  # as much goes down as up
        above = above @ _arrival(above, faces.areas, half)
        below = below @ _arrival(below, faces.areas, half)
        lamps = lamps @ _arrival(lamps, faces.areas, lit.lamps.areas)
    day = np.pi * (above @ lit.above + below @ lit.below)
    return day[:, None] + np.pi * (lamps @ lit.lamp_luminances)


def _arrival(shares: csr_array, areas: Floats, emitting: Floats) -> csr_array:
    """Scale so that all the flux of each source arrives: Σ_i A_i F_ij = A_j."""
    arriving = areas @ shares
    return diags_array(np.where(arriving > 0.0, emitting / np.where(arriving > 0.0, arriving, 1.0), 0.0))


def window_factors(cards: Cards, windows: Quads, plan: FloorPlan) -> tuple[csr_array, csr_array]:
    """Form factors to what is seen of each window above and below the card's height, (m, w) each."""
    shape, rows = (len(cards), len(windows)), []
    for i, j in pairs_in_sight(cards, windows, plan):
        corners, normals = windows.corners[j] - cards.points[i, None], cards.normals[i]
        rows.append((*window_factor(corners, normals), i, j))
    above, below, i, j = (np.concatenate(part) for part in zip(*rows, strict=True))
    return csr_array((above, (i, j)), shape), csr_array((below, (i, j)), shape)


def sun_on_faces(plan: FloorPlan, faces: Quads, outdoors: Daylight) -> Floats:
    """Mean illuminance of faces by the direct sun, (n,) [lx], less what the windows' frames keep off."""
    beam = sun_direction(outdoors, plan.place.x_azimuth)
    facing = -faces.normals @ beam
    met = np.flatnonzero((facing > 0.0) & (outdoors.direct > 0.0))
    steps = (np.arange(SUN_SAMPLES) + 0.5) / SUN_SAMPLES
    corners = faces.corners[met]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    places = np.stack([corners[:, 0] + a * u + b * v for a in steps for b in steps], axis=1)
    share = sunlit(plan, places.reshape(-1, 3), beam).reshape(len(met), len(steps) ** 2).mean(axis=1)
    lux = np.zeros(len(faces))
    lux[met] = (1.0 - FRAME_SHARE) * outdoors.direct * facing[met] * share
    return lux


# --- light from patch to patch ---


def exchange(faces: Quads, plan: FloorPlan) -> csr_array:
    """Form factors between patches, (n, n), the same both ways: A_i F_ij = A_j F_ji.

    In a closed room they are scaled until each patch sees patches all over its half space, so no light is lost; in
    one with gaps only those that see more than that are scaled.
    """
    areas = faces.areas
    flux = diags_array(areas) @ form_factors(Cards(faces.centres, faces.normals), faces, plan)
    flux = ((flux + flux.T) / 2).tocsr()
    scale = np.ones(len(faces))
    for _ in range(SCALINGS):
        sums = scale * (flux @ scale)
        missing = np.where(sums > 0.0, areas / np.where(sums > 0.0, sums, 1.0), 1.0)
        scale *= np.sqrt(missing if closed(plan) else np.minimum(missing, 1.0))
    return (diags_array(scale / areas) @ flux @ diags_array(scale)).tocsr()


def solve(albedo: Floats, direct: Floats, between: csr_array) -> Floats:
    """Return B = ρ (E + F B), (n, k), for E (n, k), reflection by reflection until it stands."""
    rho = albedo[:, None]
    exitance = rho * direct
    for _ in range(MOST):
        before, exitance = exitance, rho * (direct + between @ exitance)
        if settled(before, exitance):
            break
    return exitance
