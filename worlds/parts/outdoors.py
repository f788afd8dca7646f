"""Outdoor parts: kerbs, markings, trees, lamp posts, and the land around the ground of the plan."""

import math
from functools import partial
from itertools import pairwise

import mujoco
import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.parts import scenery
from refseq_bench.worlds.parts.facets import Facets, joined, quad, show
from refseq_bench.worlds.parts.shell import PROUD
from refseq_bench.worlds.parts.site import Site
from refseq_bench.worlds.plans.footprints import POST_RADIUS
from refseq_bench.worlds.plans.frame import LocalFrame, quaternion
from refseq_bench.worlds.plans.schema import FloorPlan, Kerb, Marking, Material, Post, Tree

AROUND = 500.0
"""Side of the land around the plan [m]: beyond it there is only the picture of the horizon."""
BELOW = 0.03
"""Depth of that land below the ground of the plan [m]: enough for the depth buffer at 200 m."""
MOTTLE = 3.0
"""Side of the picture that repeats on markings, and on the land around [m]."""
LEAVES, STEMS, POLES, LAND = "built-in:leaf", "built-in:bark", "built-in:pole", "built-in:land"
"""Materials of what no plan names one for."""
LEAF = Material(albedo=0.12, roughness=1.0)
BARK = Material(albedo=0.14, roughness=1.0)
POLE = Material(albedo=0.35, roughness=0.5)
CLUSTERS = 320
"""Bunches of leaves of a crown."""
CLUSTER = 0.17
"""Radius of a bunch of leaves, as a share of the crown's."""
CLUSTER_RIM = 5
"""Tips of a bunch of leaves."""
ARM = 0.9
"""Length by which a lamp post's head stands out from it [m]."""
HEAD = (0.55, 0.26, 0.10)
"""Length, width and height of a lamp post's head [m]."""

CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER


def furnish_grounds(site: Site, plan: FloorPlan) -> None:
    """Lay kerbs and markings, plant the trees, put up the lamp posts, without their light."""
    if plan.ceiling is None:
        _land(site, plan)
    for name in sorted({m.material for m in plan.marking}):
        key, material = f"material:{name}:mottled", plan.material[name]
        site.picture(key, partial(scenery.mottled, material.albedo, site.rng(key)), material)
    for marking in plan.marking:
        _marking(site, marking)
    for kerb in plan.kerb:
        _kerb(site, kerb)
    if plan.tree:
        site.picture(LEAVES, partial(scenery.foliage, LEAF.albedo, site.rng(LEAVES)), LEAF)
        site.plain(STEMS, BARK)
    for tree in plan.tree:
        _tree(site, tree)
    if plan.post:
        site.plain(POLES, POLE)
    for post in plan.post:
        _post(site, post)


def _land(site: Site, plan: FloorPlan) -> None:
    low, high = plan.bounds
    land = Material(albedo=plan.place.ground_albedo, roughness=1.0)
    site.texture(LAND, partial(scenery.mottled, land.albedo, site.rng(LAND)))
    site.papered(LAND, LAND, land, (AROUND / MOTTLE, AROUND / MOTTLE))
    middle = [*(low + high) / 2, -BELOW]
    site.plane("land", middle, quaternion([1, 0, 0], [0, 0, 1]), (AROUND, AROUND), LAND)


# --- along lines ---


def _marking(site: Site, marking: Marking) -> None:
    """Paint, or soil, asphalt, grass, as flat strips; a line that goes back along itself is painted once."""
    strips = [_strip(np.array(a), np.array(b), marking.width) for a, b in _stretches(marking.points)]
    show(site, f"marking:{marking.name}", joined(strips), f"material:{marking.material}:mottled", cast=False)


def _stretches(points: tuple[tuple[float, float], ...]) -> list[tuple[tuple[float, float], ...]]:
    """Each piece of a line once, whichever way it goes, in the order of the line."""
    return list(dict.fromkeys(tuple(sorted(piece)) for piece in pairwise(points)))


def _strip(a: Floats, b: Floats, width: float) -> Facets:
    side = width / 2 * LocalFrame.between(a, b).inward
    corners = np.array([a - side, b - side, b + side, a + side])
    facet = quad(np.column_stack([corners, np.full(4, PROUD)]))
    return Facets(facet.points, corners / MOTTLE, facet.triangles)


def _kerb(site: Site, kerb: Kerb) -> None:
    """One stone a stretch, square at its ends: at a corner two stones share half a width."""
    half = kerb.width / 2
    for i, (start, end) in enumerate(pairwise(kerb.points)):
        stone = (-half, math.dist(start, end) + half), (-half, half), (0.0, kerb.height)
        site.solid(f"kerb:{kerb.name}:{i}", LocalFrame.between(start, end), stone, kerb.material)


# --- trees and posts ---


def _tree(site: Site, tree: Tree) -> None:
    """A trunk that is touched, and a crown of leaves that is only seen."""
    stem = tree.height - tree.crown
    pos = [*tree.at, stem / 2]
    site.shape(f"tree:{tree.name}", CYLINDER, pos, [tree.trunk, stem / 2, 0], STEMS)
    crown = _crown(tree, site.rng(f"tree:{tree.name}"))
    show(site, f"tree:{tree.name}:crown", crown, LEAVES, cast=True)


def _crown(tree: Tree, rng: np.random.Generator) -> Facets:
    """Bunches of leaves all through an uneven ball, denser outside."""
    out, lumps = _directions(CLUSTERS, rng), _directions(6, rng)
    reach = 0.72 + 0.28 * np.max(out @ lumps.T, axis=1)
    distance = tree.crown * reach * rng.uniform(0.2, 1.0, CLUSTERS) ** (1 / 3)
    middle = np.array([*tree.at, tree.height - tree.crown])
    return _stars(middle + distance[:, None] * out, out, CLUSTER * tree.crown, rng)


def _directions(count: int, rng: np.random.Generator) -> Floats:
    return _unit(rng.standard_normal((count, 3)))


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _stars(at: Floats, out: Floats, radius: float, rng: np.random.Generator) -> Facets:
    """Ragged stars around ``at`` (n, 3), each facing roughly along ``out`` (n, 3), and their backs."""
    n, rim = len(at), CLUSTER_RIM
    normal = _unit(out + 0.7 * rng.standard_normal((n, 3)))
    u = _unit(np.cross(normal, [0.3, 0.5, 0.8]))
    angle = 2 * np.pi * (np.arange(rim) + rng.uniform(-0.3, 0.3, (n, rim))) / rim
    flat = rng.uniform(0.45, 1.25, (n, rim))[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    flat = np.concatenate([np.zeros((n, 1, 2)), flat], axis=1)  # (n, middle and rim, 2)
    points = at[:, None] + radius * flat @ np.stack([u, np.cross(normal, u)], axis=1)
    uv = rng.uniform(0, 1, (n, 1, 2)) + 0.4 * flat
    shine = np.repeat(_unit(out + 0.6 * normal), rim + 1, axis=0)  # a crown is lit as a whole, not leaf by leaf
    star = np.stack([np.zeros(rim, int), 1 + np.arange(rim), 1 + (np.arange(rim) + 1) % rim], axis=1)
    front = (star + (rim + 1) * np.arange(n)[:, None, None]).reshape(-1, 3)
    return Facets(points.reshape(-1, 3), uv.reshape(-1, 2), np.concatenate([front, front[:, ::-1]]), shine)


def _post(site: Site, post: Post) -> None:
    frame, half = LocalFrame.under(post), post.height / 2
    site.shape(f"post:{post.name}", CYLINDER, [*post.at, half], [POST_RADIUS, half, 0], POLES)
    length, width, height = HEAD
    arm = ((0.0, ARM), (-0.03, 0.03), (post.height - 0.06, post.height))
    case = ((ARM - length / 2, ARM + length / 2), (-width / 2, width / 2), (post.height, post.height + height))
    site.lattice(f"post:{post.name}:arm", frame, [arm, case], POLES)
