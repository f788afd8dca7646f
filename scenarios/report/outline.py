"""The walls of the world that drives were in, for plans in reports."""

from collections.abc import Sequence

from scenarios.report.plots.plan import FloorOutline
from scenarios.scoring.comparison import Comparison
from worlds.drawing.outline import outline_of
from worlds.plans.load import load_plan, world_names


def outline_for(comparisons: Sequence[Comparison]) -> FloorOutline | None:
    """The walls, where all drives were in the same world of the library."""
    worlds = {str(one.reference_metadata.get("world", "")) for one in comparisons}
    world = worlds.pop()
    return outline_of(load_plan(world)) if not worlds and world in world_names() else None
