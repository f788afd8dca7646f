"""Form factors: which share of what a small card sees is filled by a rectangle, and whether walls stand between them.

The card has a place and a normal and no size. The share is weighted with the cosine at the card, so that a rectangle of
luminance L [cd/m²] gives it π L F [lx].
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, Wall

if TYPE_CHECKING:  # slow to import: worlds are built without it
    from scipy.sparse import csr_array

SIGHT = 20.0
"""Farther rectangles are not looked at [m]; a choice: in a corridor 2.4 m wide they fill less than 1 % of the view."""
NEAR = 3.0
"""Rectangles farther than this many times the side of a square of their area are taken for points; a choice: at that
distance a facing one is wrong by 4 %, and most are smaller in the view."""
SKIN = 1e-3
"""Points less than this in front of a face [m] lie in it."""
BLOCK = 96
"""Cards that are looked at together; neighbours in a list are mostly neighbours in the room."""


@dataclass(frozen=True, slots=True)
class Quads:
    """Rectangles with one lit side: ``corners`` (n, 4, 3) [m], counter-clockwise as seen from that side."""

    corners: Floats

    @classmethod
    def tiled(cls, origin: ArrayLike, u: ArrayLike, v: ArrayLike, tiles: tuple[int, int] = (1, 1)) -> "Quads":
        """Cut the rectangle that the edges ``u`` and ``v`` (3,) span at ``origin``; its lit side is that of u × v."""
        (m, n), u, v = tiles, np.asarray(u, dtype=float), np.asarray(v, dtype=float)
        steps = np.array([[i / m, j / n] for i in range(m) for j in range(n)])
        first = np.asarray(origin, dtype=float) + steps @ np.array([u, v])
        around = np.array([[0.0, 0.0], [1 / m, 0.0], [1 / m, 1 / n], [0.0, 1 / n]]) @ np.array([u, v])
        return cls(first[:, None, :] + around)

    @classmethod
    def joined(cls, parts: list["Quads"]) -> "Quads":
        """Put several together, in their order."""
        return cls(np.concatenate([part.corners for part in parts]) if parts else np.empty((0, 4, 3)))

    def __len__(self) -> int:
        return len(self.corners)

    @property
    def centres(self) -> Floats:
        """Middles, (n, 3) [m]."""
        return self.corners.mean(axis=1)

    @property
    def areas(self) -> Floats:
        """Areas, (n,) [m²]."""
        return np.linalg.norm(self._spanned, axis=1)

    @property
    def normals(self) -> Floats:
        """Unit vectors out of the lit side, (n, 3)."""
        return self._spanned / self.areas[:, None]

    @property
    def _spanned(self) -> Floats:
        return np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 3] - self.corners[:, 0])


@dataclass(frozen=True, slots=True)
class Cards:
    """Small flat cards: ``points`` (m, 3) [m] and unit ``normals`` (m, 3)."""

    points: Floats
    normals: Floats

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, which: slice) -> "Cards":
        return Cards(self.points[which], self.normals[which])


# --- one card, one rectangle ---


def configuration_factor(corners: Floats, normals: Floats) -> Floats:
    """Return the form factor from cards at the origin with ``normals`` (p, 3) to ``corners`` (p, 4, 3), (p,).

    Lambert's formula F = Σ θ_k (n · Γ_k) / 2π over the edges k, which are seen under the angles θ_k from the origin;
    Γ_k is the unit vector at right angles to both ends. What is below the card's horizon is cut off first.
    """
    heights = np.einsum("pkc,pc->pk", corners, normals)
    start, stop, closing = _above_horizon(corners, heights)
    edges = [(start[:, k], stop[:, k]) for k in range(4)] + [closing]
    total = sum(_edge(a, b, normals) for a, b in edges)
    return np.maximum(0.0, -total / (2 * np.pi))


def window_factor(corners: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Form factors to what is seen of a window above and below a card's height, (p,) each.

    ``corners`` (p, 4, 3) are from each card, as for ``configuration_factor``: a window shows the sky above, the ground
    below.
    """
    up, down = corners.copy(), corners.copy()
    np.maximum(corners[..., 2], 0.0, out=up[..., 2])
    np.minimum(corners[..., 2], 0.0, out=down[..., 2])
    return configuration_factor(up, normals), configuration_factor(down, normals)


def _above_horizon(corners: Floats, heights: Floats) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
    """Cut each edge at height 0: starts and ends (p, 4, 3), and the new edge along the horizon where there is one."""
    after, next_height = np.roll(corners, -1, axis=1), np.roll(heights, -1, axis=1)
    up, next_up = heights > 0.0, next_height > 0.0
    share = np.where(up != next_up, heights / np.where(up != next_up, heights - next_height, 1.0), 0.0)
    cut = corners + share[..., None] * (after - corners)
    start, stop = np.where(up[..., None], corners, cut), np.where(next_up[..., None], after, cut)
    stop = np.where((up | next_up)[..., None], stop, start)
    leaves, enters = (up & ~next_up)[..., None], (~up & next_up)[..., None]
    return start, stop, ((cut * leaves).sum(axis=1), (cut * enters).sum(axis=1))


def _edge(a: Floats, b: Floats, normals: Floats) -> Floats:
    across = np.cross(a, b)
    length = np.sqrt(np.einsum("pc,pc->p", across, across))
    angle = np.arctan2(length, np.einsum("pc,pc->p", a, b))
    return angle * np.einsum("pc,pc->p", across, normals) / np.where(length > 0.0, length, 1.0)


# --- many cards, many rectangles ---


def form_factors(cards: Cards, faces: Quads, plan: FloorPlan) -> "csr_array":
    """Return the form factors from ``cards`` (m) to ``faces`` (n), (m, n).

    Nearby they are exact, farther off A cosα cosβ / π d².
    """
    from scipy.sparse import coo_array

    shape, rows = (len(cards), len(faces)), []
    for i, j in pairs_in_sight(cards, faces, plan):
        ray, normals = faces.centres[j] - cards.points[i], cards.normals[i]
        near = np.einsum("pc,pc->p", ray, ray) < NEAR**2 * faces.areas[j]
        shares = _as_points(ray, normals, faces, j)
        shares[near] = configuration_factor(faces.corners[j[near]] - cards.points[i[near], None], normals[near])
        rows.append((shares, i, j))
    shares, i, j = (np.concatenate(part) for part in zip(*rows, strict=True))
    return coo_array((shares, (i, j)), shape).tocsr()


def _as_points(ray: Floats, normals: Floats, faces: Quads, j: NDArray[np.intp]) -> Floats:
    square = np.einsum("pc,pc->p", ray, ray)
    at_card, at_face = np.einsum("pc,pc->p", ray, normals), -np.einsum("pc,pc->p", ray, faces.normals[j])
    return np.maximum(0.0, at_card) * at_face * faces.areas[j] / (np.pi * square**2)


def pairs_in_sight(cards: Cards, faces: Quads, plan: FloorPlan) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield indices (i, j) of cards and faces whose middles see each other within ``SIGHT``, some cards at a time.

    A face must show its lit side and reach above the card's horizon. Only walls up to the ceiling hide anything.
    """
    centres, normals = faces.centres, faces.normals
    offset, radius = np.einsum("nc,nc->n", centres, normals), np.linalg.norm(faces.corners[:, 0] - centres, axis=1)
    for first in range(0, max(1, len(cards)), BLOCK):
        points, facing = cards.points[first : first + BLOCK], cards.normals[first : first + BLOCK]
        near = np.flatnonzero(_around(points, centres))
        height = facing @ centres[near].T - np.einsum("mc,mc->m", points, facing)[:, None]
        i, j = np.nonzero((height > -radius[near]) & (points @ normals[near].T - offset[near] > SKIN))
        ray = centres[near[j]] - points[i]
        close = np.einsum("pc,pc->p", ray, ray) < SIGHT**2
        i, j = i[close], j[close]
        seen_from, seen_at = points + SKIN * facing, centres[near] + SKIN * normals[near]
        clear = ~hidden(plan, seen_from[:, :2], seen_at[:, :2], i, j)
        yield first + i[clear], near[j[clear]]


def _around(points: Floats, centres: Floats) -> NDArray[np.bool_]:
    """Tell whether faces can be in sight of any of the points at all, (n,)."""
    low, high = points.min(axis=0, initial=np.inf) - SIGHT, points.max(axis=0, initial=-np.inf) + SIGHT
    return ((low < centres) & (centres < high)).all(axis=1)


def hidden(plan: FloorPlan, a: Floats, b: Floats, i: NDArray[np.intp], j: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Tell which lines in plan from ``a[i]`` to ``b[j]`` (each (·, 2) [m]) cross a wall that reaches the ceiling."""
    crossed = np.zeros(len(i), dtype=bool)
    for wall in plan.full_walls:
        crossed |= _crossed(wall, a, b, i, j)
    return crossed


def _crossed(wall: Wall, a: Floats, b: Floats, i: NDArray[np.intp], j: NDArray[np.intp]) -> NDArray[np.bool_]:
    frame, crossed = LocalFrame.of(wall), np.zeros(len(i), dtype=bool)
    axes = np.stack([frame.along, frame.inward], axis=1)
    (along_a, out_a), (along_b, out_b) = ((a - frame.origin) @ axes).T, ((b - frame.origin) @ axes).T
    maybe = _either_side(out_a, out_b, i, j)
    i, j = i[maybe], j[maybe]
    at = along_a[i] + out_a[i] / (out_a[i] - out_b[j]) * (along_b[j] - along_a[i])
    crossed[maybe] = (at > -SKIN) & (at < wall.length + SKIN)
    return crossed


def _either_side(out_a: Floats, out_b: Floats, i: NDArray[np.intp], j: NDArray[np.intp]) -> NDArray[np.intp]:
    """Indices of the pairs that have the wall's line between them; most walls have all on one side."""
    behind_a, behind_b = out_a < 0.0, out_b < 0.0
    if not (behind_a.any() or behind_b.any()) or (behind_a.all() and behind_b.all()):
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(behind_a[i] != behind_b[j])
