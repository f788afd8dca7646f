"""The part of a section about an atlas: the joins against the truth, and the drive that each method answered."""

from collections.abc import Sequence
from dataclasses import dataclass

from refseq_bench.scenarios.report.page import PageRow, PageTable
from refseq_bench.scenarios.report.plots.atlas import joined_plan, which_drive
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.report.words import distances
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.figures import Figures
from refseq_bench.scenarios.scoring.path_geometry import Tolerance
from refseq_bench.scenarios.scoring.tables.score_tables import join_cells, shares_cell
from refseq_bench.scenarios.scoring.truth import has_truth
from refseq_bench.scenarios.tables import counted

HEADINGS = (
    "method",
    "way to P(right) > 0.9 after a fork",
    "P(sequence) before / on / behind what paths share",
    "jumps by true poses",
    "joins (false)",
    "joined rightly, of views taken out [%]",
    "joined, of views shared [%]",
    "places left",
    "there twice",
    "maps [kB]",
)


@dataclass(frozen=True)
class JoinRow:
    """The decision about one stretch, in words."""

    joined: bool
    one: str
    other: str
    why: str


@dataclass(frozen=True)
class AtlasPart:
    """The figures of all methods, the drive that each drawn one answered, and the joins of the judged one."""

    table: PageTable
    shares: Plot
    plan: Plot | None
    joins: tuple[JoinRow, ...]


def atlas_part(
    run: Comparison,
    figures: Sequence[Figures],
    drawn: Sequence[str],
    judged: str,
    within: Tolerance,
    outline: FloorOutline | None,
) -> AtlasPart | None:
    """The part about several drives, of which one ``run`` is drawn; None where one drive was learnt."""
    rows = tuple(
        PageRow(
            method_label(one.method),
            (
                distances(one.atlas.forks),
                shares_cell(one.atlas.shares),
                counted(one.atlas.jumps),
                *join_cells(one.atlas.joined),
            ),
        )
        for one in figures
        if one.atlas is not None
    )
    if not rows:
        return None
    merging = run.mergings.get(judged)
    return AtlasPart(
        table=PageTable(HEADINGS, rows),
        shares=which_drive(run, drawn, within),
        plan=joined_plan(run, merging, within, outline) if merging and has_truth(run.reference_views) else None,
        joins=tuple(
            JoinRow(
                one.joined,
                f"{one.one} {one.first[0]}-{one.first[1]}",
                f"{one.other} {one.second[0]}-{one.second[1]}",
                one.why,
            )
            for one in (merging.decisions if merging else ())
        ),
    )
