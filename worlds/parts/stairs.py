"""Flights of steps: solid, so that a laser and a robot find them, with dark nosings and a handrail on each side."""

import mujoco
import numpy as np

from refseq_bench.worlds.arrays import Block
from refseq_bench.worlds.parts.site import SEEN, TRIM, Site
from refseq_bench.worlds.plans.frame import LocalFrame, quaternion
from refseq_bench.worlds.plans.schema import FloorPlan, Stairs

NOSING, PROUD = 0.045, 0.003
"""Length that the dark strip reaches back from a step's edge and down it, and how far it stands out [m]."""
RAIL_HEIGHT, RAIL_RADIUS, RAIL_INSET = 0.9, 0.022, 0.07
"""Of a handrail: its axis above the steps' edges, its radius, its distance from the side of the flight [m]."""
POST, POST_EVERY = 0.03, 3
"""Side of a post under a handrail [m], and how many steps apart the posts stand."""


def raise_stairs(site: Site, plan: FloorPlan) -> None:
    """Build the flights of the plan: steps that are seen and touched, nosings and handrails that are only seen."""
    height = plan.ceiling.height if plan.ceiling is not None else np.inf
    for flight in plan.stairs:
        key, frame = f"stairs:{flight.name}", LocalFrame.under(flight)
        for i, step in enumerate(_steps(flight)):
            site.solid(f"{key}:{i}", frame, step, flight.material)
        site.lattice(f"{key}:nosings", frame, _nosings(flight), TRIM, cast=False)
        _handrails(site, key, frame, flight, height)


def _steps(flight: Stairs) -> list[Block]:
    """Cut the flight into steps, each from the floor up to its tread: there is nothing under the stairs."""
    half, run, rise = flight.width / 2, flight.run, flight.rise
    return [((i * run, (i + 1) * run), (-half, half), (0.0, (i + 1) * rise)) for i in range(flight.steps)]


def _nosings(flight: Stairs) -> list[Block]:
    return [((s - PROUD, s + NOSING), out, (top - NOSING, top + PROUD)) for (s, _), out, (_, top) in _steps(flight)]


def _handrails(site: Site, key: str, frame: LocalFrame, flight: Stairs, ceiling: float) -> None:
    """Lay a round bar along each side, on posts, from the first edge to the last one that leaves room for it."""
    edges = [(s, z) for (s, _), _, (_, z) in _steps(flight) if z + RAIL_HEIGHT + RAIL_RADIUS <= ceiling]
    if len(edges) < 2:
        return
    sides = {"right": RAIL_INSET - flight.width / 2, "left": flight.width / 2 - RAIL_INSET}
    for side, out in sides.items():
        foot, head = (frame.point(s, out, z + RAIL_HEIGHT) for s, z in (edges[0], edges[-1]))
        _bar(site, f"{key}:rail:{side}", foot, head)
    posts = [_post(s, out, z) for s, z in edges[::POST_EVERY] for out in sides.values()]
    site.lattice(f"{key}:posts", frame, posts, TRIM)


def _post(s: float, out: float, foot: float) -> Block:
    return (s + NOSING, s + NOSING + POST), (out - POST / 2, out + POST / 2), (foot, foot + RAIL_HEIGHT)


def _bar(site: Site, name: str, foot: np.ndarray, head: np.ndarray) -> None:
    up = (head - foot) / np.linalg.norm(head - foot)
    level = np.cross(up, [0.0, 0.0, 1.0])
    middle, size = (foot + head) / 2, [RAIL_RADIUS, float(np.linalg.norm(head - foot)) / 2, 0.0]
    turn = quaternion(level / np.linalg.norm(level), up)
    site.shape(name, mujoco.mjtGeom.mjGEOM_CYLINDER, middle, size, TRIM, SEEN, quat=turn, castshadow=False)
