"""The worlds of the library and their routes, by their plans alone: nothing is built, and no physics are imported."""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

from refseq_bench.scenarios.tables import TextTable
from refseq_bench.worlds.plans.load import load_plan, world_names
from refseq_bench.worlds.plans.schema import LINES, ON_WALL, STANDING, FloorPlan, Point

THINGS = (*ON_WALL, *STANDING, *LINES)
GENERATED = (
    ("corridor:SEED", "A new corridor from any whole number from 0", "40 to 120", "forward ⇄"),
    (
        "building:SEED",
        "A new building, with loops and wings",
        "29 to 66 × 13 to 20",
        "forward ⇄, wing, last-wing, detour",
    ),
)


def library() -> list[dict[str, object]]:
    """The worlds of the library, for other programs."""
    return [
        {
            "name": name,
            "title": plan.title,
            "size_m": (plan.bounds[1] - plan.bounds[0]).tolist(),
            "routes_m": {route: round(length(points), 3) for route, points in plan.routes.items()},
            "things": dict(things(plan)),
        }
        for name, plan in ((name, load_plan(name)) for name in world_names())
    ]


def library_table() -> TextTable:
    """The worlds of the library, a row each, and those that are made from a seed."""
    table = TextTable("world", "what", "size [m]", "routes [m]", ">things", wraps=("what", "routes [m]"))
    for name in world_names():
        plan = load_plan(name)
        table.add_row(name, plan.title, size_text(plan), routes_text(plan), str(sum(things(plan).values())))
    for row in GENERATED:
        table.add_row(*row, "")
    return table


def size_text(plan: FloorPlan) -> str:
    """Length and width of a plan's ground [m]."""
    x, y = plan.bounds[1] - plan.bounds[0]
    return f"{x:g} × {y:g}"


def routes_text(plan: FloorPlan) -> str:
    """Routes and their lengths [m]; those along the same line are told once, with ⇄ where they go both ways."""
    lines: dict[tuple[Point, ...], list[str]] = {}
    for name, points in plan.routes.items():
        lines.setdefault(min(points, points[::-1]), []).append(name)
    there = set(plan.routes.values())
    told = ((line, names[0], " ⇄" if {line, line[::-1]} <= there else "") for line, names in lines.items())
    return ", ".join(f"{name}{ways} {length(line):.0f}" for line, name, ways in told)


def length(points: Sequence[Point]) -> float:
    """Length of a line of points [m]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def things(plan: FloorPlan) -> Counter[str]:
    """Count the things of each kind."""
    found: Counter[str] = Counter()
    for table in THINGS:
        found.update(getattr(item, "kind", table) if table == "fixture" else table for item in getattr(plan, table))
    return found
