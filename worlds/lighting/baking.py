"""Light on every surface of a world, the direct sun apart: from windows, lamps and sky, past all that stands there.

Luminous rectangles are seen whole or in part (Lambert's form factor times the share of a few points that are in sight);
light from other surfaces is gathered by rays that leave a card by the cosine of their angle to its normal, so that its
illuminance is the mean exitance of what they meet; reflection after reflection, until it stands.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.rows import distinct_rows
from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.lighting.form_factors import SIGHT, Cards, Quads, configuration_factor, window_factor
from refseq_bench.worlds.lighting.occluders import AWAY, Occluders
from refseq_bench.worlds.lighting.open_air import head_of, post_illuminance
from refseq_bench.worlds.lighting.photometry import Photometry, Sources, outlook, sources, transmission
from refseq_bench.worlds.lighting.reflections import MOST, settled
from refseq_bench.worlds.plans.schema import FloorPlan, Post

RAYS = 64
"""Rays that a card sends out; a choice: the same ones from all, so that neighbours err alike."""
FEWEST = 8
"""Fewest reflections of light that are followed, however little they add."""
SPARSE = 2
"""Every so many of its rays tell whether a card lies inside something."""
LIFT = 0.05
"""Light is asked so far in front of a surface [m]: what hangs flat on a wall, as a board, shades none of it."""
PATCH = 0.5
"""Side of a patch of sun that is taken for one source [m]; a choice."""
FAINT = 2e-4
"""Light of a patch is left out where it gives less than this share of its lumens to a square metre; a choice."""
SIDES = 3
"""A rectangle is seen as far as of a grid of so many points each way."""
BLOCK = 8192
"""Cards that are looked at together."""


@dataclass(frozen=True, slots=True)
class Shell:
    """The surfaces of a world that stand still, in triangles, and points on them at which light is asked.

    ``triangles`` (f, 3, 3) [m] with ``albedo`` (f,), the mean of its picture; ``cards`` (n) are the points, and
    ``corners`` (f, 3) tell which of them lie at the corners of each triangle.
    """

    triangles: Floats
    albedo: Floats
    cards: Cards
    corners: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Baked:
    """Illuminance but the direct sun's at a shell's points, ``lux`` (n,), and ``around`` (m,) on other cards [lx].

    Points that are ``buried`` (n,) lie within something, as those of a wall behind a cabinet: theirs says nothing.
    """

    lux: Floats
    buried: NDArray[np.bool_]
    around: Floats


@dataclass(frozen=True, slots=True)
class WorldLight:
    """All that shines in a world, and nothing else of its plan: with one shell and one of these the baked light is one.

    ``interior`` are windows and burning lamps, None in the open, where ``posts`` burn and ``outlook`` is the luminance
    above and below the horizon [cd/m²]. ``sun`` is what faces it behind the glass [lx], ``towards_sun`` (3,) the way.
    """

    interior: Sources | None
    posts: tuple[Post, ...]
    outlook: tuple[float, float]
    sun: float
    towards_sun: Floats


def world_light(plan: FloorPlan, numbers: Photometry) -> WorldLight:
    """Look up what shines in a plan."""
    indoors, outdoors = plan.ceiling is not None, numbers.outdoors
    return WorldLight(
        interior=sources(plan, numbers) if indoors else None,
        posts=() if indoors else numbers.lit_posts,
        outlook=outlook(plan, outdoors),
        sun=transmission(plan) * outdoors.direct,
        towards_sun=-sun_direction(outdoors, plan.place.x_azimuth),
    )


def bake(light: WorldLight, shell: Shell, others: Cards) -> Baked:
    """Work out the light on a shell and on other cards, as a camera gathers it."""
    occluders, own = Occluders(shell.triangles), len(shell.cards)
    points = np.concatenate([shell.cards.points + LIFT * shell.cards.normals, others.points])
    cards = Cards(points, np.concatenate([shell.cards.normals, others.normals]))
    seen, inside = _gathered(occluders, cards, _normals(shell.triangles))
    direct = _direct(light, occluders, cards) + _escaping(light, seen, cards.normals)
    sun = shell.albedo * _sun_on(light, occluders, shell)
    if light.interior is not None:
        # A patch of sun in a room is small and bright: few rays meet it, and on their own they would paint stripes.
        direct += _from_patches(occluders, cards, sunny_patches(shell.triangles, sun))
        sun = np.zeros_like(sun)
    clear = ~inside[shell.corners]
    weights = clear / np.maximum(1, clear.sum(axis=1, keepdims=True))
    total = direct
    for round_ in range(1, MOST + 1):
        before = total
        on_it = (total[shell.corners] * weights).sum(axis=1)
        exitance = np.append(shell.albedo * on_it + sun, 0.0)  # of what is not met: nothing
        total = direct + exitance[seen].mean(axis=1)
        if round_ >= FEWEST and settled(before, total):
            break
    return Baked(total[:own], inside[:own], total[own:])


def _normals(triangles: Floats) -> Floats:
    """Vectors across triangles, on the side from which their corners run counter-clockwise, (f, 3)."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


# --- from surface to surface ---


def hemisphere(count: int) -> Floats:
    """Directions about +z, (count, 3), as dense as the cosine of their angle to it: Vogel's sunflower, lifted up."""
    k = np.arange(count)
    radius, angle = np.sqrt((k + 0.5) / count), k * np.pi * (3.0 - np.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1.0 - radius**2)], axis=-1)


def about(normals: Floats) -> Floats:
    """Return rotations (m, 3, 3) that turn +z to each normal (m, 3), the same for equal normals."""
    axis = np.where(np.abs(normals[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(axis, normals)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([across, np.cross(normals, across), normals], axis=2)


def _directions(normals: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Rays of each distinct one of some normals (m, 3), (d, RAYS, 3), and which of them is each card's, (m,).

    A world has few of these: cards lie on walls, floors and boxes.
    """
    first, which = distinct_rows(normals)
    return np.einsum("dij,kj->dki", about(normals[first]), hemisphere(RAYS)), which


def _gathered(occluders: Occluders, cards: Cards, sides: Floats) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Which triangle each of a card's rays meets, (m, RAYS), -1: none; and which cards lie inside something, (m,).

    Such a card sees most triangles, whose outer ``sides`` (f, 3) are told, from behind.
    """
    found, inside = np.empty((len(cards), RAYS), np.int32), np.zeros(len(cards), bool)
    for part in _blocks(len(cards)):
        directions, which = _directions(cards.normals[part])
        # In the precision in which rays are cast, before there are many.
        rays, points = directions.astype(np.float32)[which], cards.points[part].astype(np.float32)
        found[part] = occluders.hit(np.repeat(points, RAYS, axis=0), rays.reshape(-1, 3)).reshape(-1, RAYS)
        few, met = directions[:, ::SPARSE][which], found[part, ::SPARSE]
        behind = (np.einsum("mkc,mkc->mk", few, sides[met]) > 0.0) & (met >= 0)
        inside[part] = behind.mean(axis=1) > 0.5
    return found, inside


def _escaping(light: WorldLight, seen: NDArray[np.int32], normals: Floats) -> Floats:
    """Light of sky and ground far off on the rays that meet nothing, (m,) [lx]; none between walls."""
    lux = np.zeros(len(seen))
    if light.interior is not None:
        return lux
    above, below = np.pi * np.array(light.outlook)
    for part in _blocks(len(seen)):
        directions, which = _directions(normals[part])
        beyond = np.where(directions[..., 2] > 0.0, above, below)
        lux[part] = np.where(seen[part] < 0, beyond[which], 0.0).mean(axis=1)
    return lux


def _sun_on(light: WorldLight, occluders: Occluders, shell: Shell) -> Floats:
    """Illuminance of triangles by the direct sun, (f,) [lx]: where its light comes from, not where it is seen."""
    share = np.zeros(len(shell.triangles))
    if light.sun <= 0.0:
        return share
    normals = _normals(shell.triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    facing = np.maximum(0.0, normals @ light.towards_sun)
    met = np.flatnonzero(facing)
    for at in (*(np.eye(3) * 0.6 + 0.4 / 3), np.full(3, 1 / 3)):
        points = np.einsum("k,fkc->fc", at, shell.triangles[met]) + AWAY * normals[met]
        share[met] += occluders.open_to(points, light.towards_sun) / 4
    return share * facing * light.sun


@dataclass(frozen=True, slots=True)
class Patches:
    """Small bright surfaces: ``points`` (k, 3) [m], ``normals`` (k, 3), areas (k,) [m²] and ``flux`` (k,) [lm]."""

    points: Floats
    normals: Floats
    areas: Floats
    flux: Floats


def sunny_patches(triangles: Floats, exitance: Floats) -> Patches:
    """Put triangles that send out light (f,) [lm/m²] together, those that lie close and face alike."""
    lit = np.flatnonzero(exitance)
    across = _normals(triangles[lit])
    areas = np.linalg.norm(across, axis=1) / 2
    normals = across / np.maximum(2 * areas, 1e-12)[:, None]
    centres = triangles[lit].mean(axis=1)
    cells = np.round(np.concatenate([centres / PATCH, normals], axis=1)).astype(int)
    _, of = distinct_rows(cells)
    weights = exitance[lit] * areas
    flux = np.bincount(of, weights).astype(float)

    def mean(vectors: Floats) -> Floats:
        return np.stack([np.bincount(of, weights * part) for part in vectors.T], axis=1) / flux[:, None]

    return Patches(mean(centres), mean(normals), np.bincount(of, areas).astype(float), flux)


def _from_patches(occluders: Occluders, cards: Cards, patches: Patches) -> Floats:
    """E = Φ cosα cosβ / (π d² + A): nearby as of a disc [lx]."""
    lux = np.zeros(len(cards))
    for point, normal, area, flux in zip(
        patches.points + AWAY * patches.normals, patches.normals, patches.areas, patches.flux, strict=True
    ):
        ways = point - cards.points
        square = np.einsum("mc,mc->m", ways, ways)
        cosines = np.maximum(0.0, np.einsum("mc,mc->m", ways, cards.normals)) * np.maximum(0.0, -ways @ normal)
        found = flux * cosines / (square * (np.pi * square + area))
        worth = np.flatnonzero(found > FAINT * flux)
        lux[worth] += found[worth] * occluders.clear(cards.points[worth], np.broadcast_to(point, (len(worth), 3)))
    return lux


# --- from windows and lamps ---


def _direct(light: WorldLight, occluders: Occluders, cards: Cards) -> Floats:
    """Light that comes straight from windows and lamps, (m,) [lx]."""
    if (lit := light.interior) is None:
        return _from_posts(light.posts, occluders, cards)
    lux = np.zeros(len(cards))
    for i, quad, j in _near_and_above(cards, lit.windows, lit.lamps):
        points, normals = cards.points[i], cards.normals[i]
        share = _share_in_sight(occluders, points, quad)
        corners = quad[None] - points[:, None]
        if j >= len(lit.windows):
            luminance = lit.lamp_luminances[j - len(lit.windows), 1]
            lux[i] += np.pi * luminance * share * configuration_factor(corners, normals)
            continue
        # From either of its sides: a window's reveal sees it from behind.
        (sky, ground), (sky_behind, ground_behind) = (
            window_factor(one, normals) for one in (corners, corners[:, ::-1])
        )
        seen = lit.above[j] * (sky + sky_behind) + lit.below[j] * (ground + ground_behind)
        lux[i] += np.pi * share * seen
    return lux


def _near_and_above(cards: Cards, windows: Quads, lamps: Quads) -> Iterator[tuple[NDArray[np.intp], Floats, int]]:
    """Each rectangle with the cards that it may shine on: near enough, and above their horizon."""
    for j, quad in enumerate(np.concatenate([windows.corners, lamps.corners])):
        near = np.flatnonzero(np.linalg.norm(cards.points - quad.mean(axis=0), axis=1) < SIGHT)
        ways = quad[None] - cards.points[near, None]
        above = (np.einsum("pkc,pc->pk", ways, cards.normals[near]) > AWAY).any(axis=1)
        yield near[above], quad, j


def _share_in_sight(occluders: Occluders, origins: Floats, quad: Floats) -> Floats:
    """Share of a rectangle (4, 3) that is seen from points (m, 3), (m,)."""
    steps = (np.arange(SIDES) + 0.5) / SIDES
    u, v = quad[1] - quad[0], quad[3] - quad[0]
    share = np.zeros(len(origins))
    for target in (quad[0] + a * u + b * v for a in steps for b in steps):
        share += occluders.clear(origins, np.broadcast_to(target, origins.shape)) / SIDES**2
    return share


def _from_posts(posts: tuple[Post, ...], occluders: Occluders, cards: Cards) -> Floats:
    """Light of the street lamps that burn and are in sight, (m,) [lx]."""
    lux = np.zeros(len(cards))
    for post in posts:
        found = camera_weight(post.kelvin) * post_illuminance(post, cards)
        lit = np.flatnonzero(found > 0.0)
        head = np.broadcast_to(head_of(post), (len(lit), 3))
        lux[lit] += found[lit] * occluders.clear(cards.points[lit], head)
    return lux


def _blocks(count: int) -> Iterator[slice]:
    return (slice(first, first + BLOCK) for first in range(0, count, BLOCK))
