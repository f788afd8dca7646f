"""The walls of the world that drives were in, for plans in reports."""

from collections.abc import Sequence

from refseq_bench.scenarios.driven_plan import driven_plan
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.worlds.drawing.outline import outline_of


def outline_for(comparisons: Sequence[Comparison]) -> FloorOutline | None:
    """The walls, and what stood there on the first reference drive's day, where all were between the same walls."""
    first, *others = (driven_plan(one.reference_metadata) for one in comparisons)
    if first is None or any(one is None or one.wall != first.wall for one in others):
        return None
    return outline_of(first)
