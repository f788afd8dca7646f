"""Plots of one comparison, for a section of a page."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from refseq_bench.scenarios.report.plots.belief import belief_heatmaps
from refseq_bench.scenarios.report.plots.calibration import reliability
from refseq_bench.scenarios.report.plots.confidence import confidence
from refseq_bench.scenarios.report.plots.errors import errors_along_path, errors_over_entropy
from refseq_bench.scenarios.report.plots.plan import FloorOutline, drive_plan
from refseq_bench.scenarios.report.plots.progress import answers_over_odometer
from refseq_bench.scenarios.report.plots.retrieval import precision_recall
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.fault_spans import fault_spans
from refseq_bench.scenarios.scoring.figures import Figures
from refseq_bench.scenarios.scoring.path_geometry import Tolerance, path_of


@dataclass(frozen=True)
class Drawings:
    """Plots of the drawn methods; None where there is nothing to draw, or no truth to score by.

    ``progress``, along the map over the odometer, stands in for the ``plan`` where there is no truth.
    """

    plan: Plot | None = None
    progress: Plot | None = None
    belief: Plot | None = None
    confidence: Plot | None = None
    errors: Plot | None = None
    retrieval: Plot | None = None
    reliability: Plot | None = None
    certainty: Plot | None = None


def drawings(
    comparison: Comparison,
    run: int,
    figures: Sequence[Figures],
    judged: str,
    tolerances: tuple[Tolerance, Tolerance],
    outline: FloorOutline | None,
) -> Drawings:
    """Draw a comparison, which is that ``run`` of the ``figures``; without any only the methods' beliefs."""
    if not comparison.beliefs:
        return Drawings()
    faults, wide = fault_spans(comparison.query_views, comparison.query_metadata), tolerances[0]
    path = path_of(comparison) if figures else None
    unscored = Drawings(
        belief=belief_heatmaps(comparison, path, wide, faults), confidence=confidence(comparison, path, wide, faults)
    )
    if path is None:
        return replace(unscored, progress=answers_over_odometer(comparison, judged, wide))
    drawn = [one for one in figures if one.method in comparison.beliefs]
    alone, pooled = {one.method: one.wide_runs[run] for one in drawn}, {one.method: one.wide for one in drawn}
    return replace(
        unscored,
        plan=drive_plan(comparison, alone[judged], outline, faults),
        errors=errors_along_path(comparison, alone, path, tolerances, faults),
        retrieval=precision_recall(pooled),
        reliability=reliability(pooled),
        certainty=errors_over_entropy(comparison, alone, tolerances),
    )
