"""The walls of the world that a query was driven in, for plans in reports."""

from collections.abc import Sequence

from refseq_bench.scenarios.driven_plan import driven_plan
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.truth import first_with_truth
from refseq_bench.worlds.drawing.outline import outline_of


def outline_for(runs: Sequence[Comparison]) -> FloorOutline | None:
    """The walls, and what stood there on the query's day, of that of the ``runs`` that is drawn; None: unknown."""
    plan = driven_plan(runs[first_with_truth(runs)].query_metadata)
    return None if plan is None else outline_of(plan)
