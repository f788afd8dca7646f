"""People who were not there before: some stand beside the routes, some walk to and fro along them.

Places are sought along the routes, one stretch after another; nobody comes so near to a route that a robot would
have to give way.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.change.changes import MARGIN, TRIES, WAY, drawn, free_name, kept_free, thresholds
from refseq_bench.worlds.plans.areas import Rectangle, rectangles
from refseq_bench.worlds.plans.footprints import PERSON_RADIUS, Footprint, clearance, taken
from refseq_bench.worlds.plans.frame import left_of
from refseq_bench.worlds.plans.schema import FloorPlan, Person

STAND_EVERY, WALK_EVERY = 8.0, 16.0
"""At strength 1 there is one person who stands, or one who walks, in so many metres of route: choices."""
BESIDE = np.arange(WAY + PERSON_RADIUS + 0.005, 3.0, 0.02)
"""Distances of people from a route [m]: up to where a camera still shows them large."""
SHORTEST, LONGEST, STEP = 3.0, 12.0, 0.1
"""Least and greatest length of a way to and fro [m], which is measured in steps of ``STEP``."""
ROOM = PERSON_RADIUS + MARGIN
"""Least distance of somebody's middle from all things [m]."""
CLOTHES = 0.04, 0.6
"""Albedos of the darkest and the brightest clothes (choice)."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """A stretch of a route: its middle and its direction, (2,) each, and its ``length`` [m]."""

    name: str
    middle: Floats
    ahead: Floats
    length: float


def add_standing(plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Let people stand beside the routes, but not before doors."""
    for stretch, rng in drawn("standing", _stretches(plan, STAND_EVERY), strength, seed):
        ground = _Ground.of(plan)
        ground.taken.extend(thresholds(plan))
        spot = next(_spots(ground, stretch, rng), None)
        if spot is not None:
            plan = _joined(plan, _somebody(free_name(f"standing-{stretch.name}", plan.person), spot[None], rng))
    return plan


def add_walkers(plan: FloorPlan, strength: float, seed: int) -> FloorPlan:
    """Let people walk to and fro beside the routes, where nothing is in their way for some metres."""
    for stretch, rng in drawn("walking", _stretches(plan, WALK_EVERY), strength, seed):
        ground = _Ground.of(plan)
        ways = (_way(ground, spot, stretch.ahead) for spot in _spots(ground, stretch, rng))
        way = next((w for w in ways if np.linalg.norm(w[1] - w[0]) >= SHORTEST), None)
        if way is not None:
            turned = way[:: rng.choice([-1, 1])]
            plan = _joined(plan, _somebody(free_name(f"walking-{stretch.name}", plan.person), turned, rng))
    return plan


def _joined(plan: FloorPlan, person: Person) -> FloorPlan:
    return plan.model_copy(update={"person": (*plan.person, person)})


def _somebody(name: str, points: Floats, rng: Generator) -> Person:
    """Return a person on a way, or at a place, (n, 2) [m]."""
    at, *walk = (tuple(point) for point in points.round(3).tolist())
    return Person(
        name=name,
        at=at,
        walk=tuple(walk),
        heading=round(float(rng.uniform(0.0, 360.0)), 1),
        height=round(float(np.clip(rng.normal(1.71, 0.08), 1.5, 1.9)), 2),
        albedo=round(float(np.exp(rng.uniform(*np.log(CLOTHES)))), 3),
        speed=round(float(rng.uniform(0.9, 1.4)), 2),
    )


# --- where ---


def _stretches(plan: FloorPlan, length: float) -> dict[str, _Stretch]:
    """Cut the routes into stretches; where several share their way it counts once."""
    found: list[_Stretch] = []
    for points in plan.routes.values():
        for middle, ahead in _along(np.array(points), length):
            if all(np.linalg.norm(middle - other.middle) >= length / 2 for other in found):
                found.append(_Stretch(str(len(found)), middle, ahead, length))
    return {stretch.name: stretch for stretch in found}


def _along(points: Floats, every: float) -> Iterator[tuple[Floats, Floats]]:
    """Yield places along a route and the direction there, the first after half of ``every`` metres."""
    wait = every / 2
    for start, end in pairwise(points):
        length = float(np.linalg.norm(end - start))
        for s in np.arange(wait, length, every):
            yield start + s * (end - start) / length, (end - start) / length
        wait = (wait - length) % every


class _Ground(NamedTuple):
    """The ground of a plan, and what of it is taken or kept free."""

    areas: tuple[Rectangle, ...]
    taken: list[Footprint]

    @classmethod
    def of(cls, plan: FloorPlan) -> "_Ground":
        return cls(rectangles(plan), [thing.footprint for thing in taken(plan)] + kept_free(plan))


def _spots(ground: _Ground, stretch: _Stretch, rng: Generator) -> Iterator[Floats]:
    """Draw free places beside a stretch, (2,) each."""
    aside = left_of(stretch.ahead)
    for _ in range(TRIES):
        start = stretch.middle + rng.uniform(-0.5, 0.5) * stretch.length * stretch.ahead
        line = start + rng.choice([-1.0, 1.0]) * BESIDE[:, None] * aside
        free = line[_free(ground, line)]
        if len(free):
            yield free[rng.integers(len(free))]


def _way(ground: _Ground, spot: Floats, ahead: Floats) -> Floats:
    """Return how far somebody at ``spot`` can go straight on and back, (2 ends, 2)."""
    steps = np.arange(STEP, LONGEST / 2, STEP)[:, None] * ahead
    ends = []
    for steps_on in (-steps, steps):
        blocked = np.append(~_free(ground, spot + steps_on), True)
        reached = int(blocked.argmax())
        ends.append(spot + steps_on[reached - 1] if reached else spot)
    return np.array(ends)


def _free(ground: _Ground, points: Floats) -> NDArray[np.bool_]:
    """Tell whether somebody can be at each of ``points`` (n, 2)."""
    within = np.any([np.all((a.low <= points) & (points <= a.high), axis=1) for a in ground.areas], axis=0)
    return np.asarray(within & (clearance(points, ground.taken) >= ROOM))
