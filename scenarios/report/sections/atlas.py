"""What a page shows where several drives were learnt: the joins, against the truth, and which drive was answered."""

from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.report.page import ways
from scenarios.report.plots.atlas import joined_plan, which_drive
from scenarios.report.plots.plan import FloorOutline
from scenarios.report.plots.style import Plot
from scenarios.scoring.comparison import Comparison, method_label
from scenarios.scoring.figures import Figures
from scenarios.scoring.path_geometry import Tolerance
from scenarios.scoring.tables import join_cells


@dataclass(frozen=True)
class AtlasRow:
    """One method's figures, in words."""

    label: str
    fork: str
    jumps: str
    joined: tuple[str, ...]


@dataclass(frozen=True)
class JoinRow:
    """What was decided about one stretch, in words."""

    joined: bool
    one: str
    other: str
    why: str


@dataclass(frozen=True)
class AtlasShown:
    """The figures of all methods, which drive each drawn one answered, and the joins of the one that is judged."""

    rows: tuple[AtlasRow, ...]
    shares: Plot
    plan: Plot | None
    joins: tuple[JoinRow, ...]


def atlas_shown(
    run: Comparison,
    found: Sequence[Figures],
    shown: Sequence[str],
    judged: str,
    within: Tolerance,
    outline: FloorOutline | None,
) -> AtlasShown | None:
    """The part of a page about the atlas, of which one ``run`` is drawn; None where one drive was learnt."""
    rows = tuple(_row(one) for one in found if one.atlas is not None)
    if not rows:
        return None
    merging = run.mergings.get(judged)
    return AtlasShown(
        rows=rows,
        shares=which_drive(run, shown, within),
        plan=None if merging is None else joined_plan(run, merging, within, outline),
        joins=()
        if merging is None
        else tuple(
            JoinRow(
                one.joined,
                f"{one.one} {one.first[0]}-{one.first[1]}",
                f"{one.other} {one.second[0]}-{one.second[1]}",
                one.why,
            )
            for one in merging.decisions
        ),
    )


def _row(one: Figures) -> AtlasRow:
    assert one.atlas is not None  # whoever asks has looked
    forks = ways(one.atlas.forks)
    return AtlasRow(method_label(one.method), forks, str(one.atlas.jumps), tuple(join_cells(one.atlas.joined)))
