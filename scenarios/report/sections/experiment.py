"""What a page shows of the drives of one experiment: tables of all methods, plots of some, frames."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from refseq.belief import Stage
from scenarios.report.plot_selection import drawn
from scenarios.report.plots.belief import belief_heatmaps
from scenarios.report.plots.calibration import reliability
from scenarios.report.plots.confidence import confidence
from scenarios.report.plots.errors import errors_along_path, errors_over_entropy
from scenarios.report.plots.plan import FloorOutline, drive_plan
from scenarios.report.plots.retrieval import precision_recall
from scenarios.report.plots.style import Plot
from scenarios.report.sections.atlas import AtlasShown, atlas_shown
from scenarios.report.sections.frames import (
    FailureShown,
    Frames,
    InMemory,
    Pictures,
    failure_shown,
    failure_wanted,
    frames,
    matches,
)
from scenarios.report.sections.tables import (
    CostTable,
    FigureRow,
    FurtherRow,
    LostRow,
    MethodRow,
    cost_table,
    figure_rows,
    further_row,
    lost_row,
    method_row,
)
from scenarios.scoring.comparison import Comparison, method_label, shared_methods
from scenarios.scoring.cost import Cost
from scenarios.scoring.fault_spans import fault_spans
from scenarios.scoring.figures import Figures, figures
from scenarios.scoring.outcome import Outcome
from scenarios.scoring.path_geometry import NARROW, WIDE, ReferencePath, Tolerance, path_of
from scenarios.scoring.score import Score
from scenarios.scoring.worst_failures import worst_failures


@dataclass(frozen=True)
class Terms:
    """How drives are looked at.

    Two tolerances; the ``judged`` method (None: the thesis' last stage, or the last method); what methods cost; where
    frames come from (None: the comparisons); the walls; the figures, where they are known already.
    """

    wide: Tolerance = WIDE
    narrow: Tolerance = NARROW
    judged: str | None = None
    costs: Mapping[str, Sequence[Cost]] = field(default_factory=dict)
    pictures: Pictures | None = None
    outline: FloorOutline | None = None
    figures: Sequence[Figures] | None = None


@dataclass(frozen=True)
class Section:
    """What the page shows of the comparisons of one name."""

    name: str
    runs: int
    drawn: str
    wide: Tolerance
    narrow: Tolerance
    table: tuple[MethodRow, ...]
    further: tuple[FurtherRow, ...]
    lost_table: tuple[LostRow, ...]
    unscored: int
    judged: str
    methods: tuple[str, ...]
    left_out: int
    plan: Plot | None
    posterior: Plot | None
    lost: Plot | None
    errors: Plot | None
    retrieval: Plot | None
    reliability: Plot | None
    certainty: Plot | None
    failures: tuple[FailureShown, ...]
    frames: tuple[Frames, ...]
    cost: CostTable
    figures: tuple[FigureRow, ...]
    atlas: AtlasShown | None

    @property
    def heading(self) -> str:
        """How far an answer may look another way [degrees]."""
        return f"{math.degrees(self.wide.heading):g}"


def section(name: str, runs: Sequence[Comparison], terms: Terms) -> Section:
    """Make a section of comparisons that differ in the seed only; the first is drawn."""
    methods = shared_methods(runs)
    scorable = bool(methods) and all(_has_truth(run) for run in runs)
    found = list(terms.figures or figures(runs, terms.wide, terms.narrow)) if scorable else []
    pooled = {one.method: one.wide for one in found}
    judged = terms.judged if terms.judged in methods else _last(methods)
    shown = drawn(methods, judged, pooled)
    path = path_of(runs[0]) if scorable else None
    drawing = _Drawing(
        replace(runs[0], beliefs={method: runs[0].beliefs[method] for method in shown}),
        path,
        {one.method: one.wide_runs[0] for one in found if one.method in shown},
        terms,
    )
    by_run = next((one.wide_runs for one in found if one.method == judged), ())
    failures = worst_failures(runs, by_run, judged) if scorable else []
    same = matches(runs[0], path, terms.wide, judged)
    pictures = (terms.pictures or InMemory(runs))(
        [wanted for one in same for wanted in one.wanted]
        + [wanted for failure in failures for wanted in failure_wanted(failure)]
    )
    same_frames = (frames(match, pictures) for match in same)
    return Section(
        name=name,
        runs=len(runs),
        drawn=_which(runs),
        wide=terms.wide,
        narrow=terms.narrow,
        table=tuple(method_row(one, judged=one.method == judged) for one in found),
        further=tuple(further_row(one) for one in found),
        lost_table=tuple(lost_row(one.method, one.wide) for one in found if one.wide.off_map.any()),
        unscored=next((one.wide.count(Outcome.UNSCORED) for one in found), 0),
        judged=method_label(judged),
        methods=tuple(method_label(method) for method in methods),
        left_out=len(methods) - len(shown),
        plan=drawing.plan(by_run[0]) if by_run else None,
        posterior=drawing.posterior() if methods else None,
        lost=drawing.lost() if methods else None,
        errors=drawing.errors() if scorable else None,
        retrieval=precision_recall({m: pooled[m] for m in shown}) if scorable else None,
        reliability=reliability({m: pooled[m] for m in shown}) if scorable else None,
        certainty=drawing.certainty() if scorable else None,
        failures=tuple(failure_shown(failure, runs, pictures) for failure in failures),
        frames=tuple(one for one in same_frames if one.pairs),
        cost=cost_table(runs, methods, terms.costs),
        figures=tuple(figure_rows(found)),
        atlas=atlas_shown(runs[0], found, shown, judged, terms.wide, terms.outline) if scorable else None,
    )


class _Drawing:
    """The plots of one comparison."""

    def __init__(
        self, comparison: Comparison, path: ReferencePath | None, scores: Mapping[str, Score], terms: Terms
    ) -> None:
        self._comparison, self._path, self._scores, self._terms = comparison, path, scores, terms
        self._tolerances = terms.wide, terms.narrow
        self._fault_spans = fault_spans(comparison.query_views, comparison.query_metadata)

    def plan(self, judged: Score) -> Plot:
        return drive_plan(self._comparison, judged, self._terms.outline, self._fault_spans)

    def posterior(self) -> Plot:
        return belief_heatmaps(self._comparison, self._path, self._terms.wide, self._fault_spans)

    def lost(self) -> Plot:
        return confidence(self._comparison, self._path, self._terms.wide, self._fault_spans)

    def errors(self) -> Plot | None:
        if self._path is None:
            return None
        return errors_along_path(self._comparison, self._scores, self._path, self._tolerances, self._fault_spans)

    def certainty(self) -> Plot:
        return errors_over_entropy(self._comparison, self._scores, self._tolerances)


def _last(methods: Sequence[str]) -> str:
    """The method whose answers are marked where none is judged: the thesis' last stage, or the last without any."""
    return next((stage for stage in reversed(Stage) if stage in methods), methods[-1] if methods else "")


def _which(runs: Sequence[Comparison]) -> str:
    """Which of several runs is drawn."""
    if len(runs) == 1:
        return ""
    seed = runs[0].query_metadata.get("seed")
    return f"the first of {len(runs)} runs" + (f" (query seed {seed})" if seed is not None else "")


def _has_truth(comparison: Comparison) -> bool:
    sides = (comparison.reference_views, comparison.query_views)
    return all(any(view.truth for view in views) for views in sides)
