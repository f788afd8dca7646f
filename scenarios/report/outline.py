"""The walls of the world that drives were in, for plans in reports."""

from collections.abc import Sequence

from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.worlds.drawing.outline import outline_of
from refseq_bench.worlds.plans.load import load_plan, world_names


def outline_for(comparisons: Sequence[Comparison]) -> FloorOutline | None:
    """The walls, where all drives were in the same world of the library."""
    worlds = {str(one.reference_metadata.get("world", "")) for one in comparisons}
    world = worlds.pop()
    return outline_of(load_plan(world)) if not worlds and world in world_names() else None
