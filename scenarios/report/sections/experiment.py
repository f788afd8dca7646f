"""The section of a page about one experiment: tables of all methods, plots of some, frames."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from refseq.belief import Stage
from refseq_bench.scenarios.report.page import PageTable
from refseq_bench.scenarios.report.plot_selection import select_methods
from refseq_bench.scenarios.report.plots.confidence import declared_faults
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.report.sections.atlas import AtlasPart, atlas_part
from refseq_bench.scenarios.report.sections.drawings import Drawings, drawings
from refseq_bench.scenarios.report.sections.frames import FailureFrames, FrameSource, PlaceFrames, frames_of
from refseq_bench.scenarios.report.sections.headline import Headline, headline, told_faults
from refseq_bench.scenarios.report.sections.tables import (
    FigureTables,
    consistency_page_table,
    cost_table,
    figure_tables,
)
from refseq_bench.scenarios.report.words import scale_words
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label, shared_methods
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.figures import Figures, figures
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, Tolerance, path_of
from refseq_bench.scenarios.scoring.tables.worst_failures import worst_failures
from refseq_bench.scenarios.scoring.truth import first_with_truth, truth_estimates, unscored_reason


@dataclass(frozen=True)
class SectionSettings:
    """Choices for a section.

    Two tolerances; the ``judged`` method (None: the thesis' last stage, or the last method); the methods' ``costs``;
    the source of the frames (None: the comparisons); the walls that the query was driven between; the figures, where
    they are known already.
    """

    wide: Tolerance = WIDE
    narrow: Tolerance = NARROW
    judged: str | None = None
    costs: Mapping[str, Sequence[Cost]] = field(default_factory=dict)
    frames: FrameSource | None = None
    outline: FloorOutline | None = None
    figures: Sequence[Figures] | None = None


@dataclass(frozen=True)
class Section:
    """The contents of a section; ``drawn`` says which of several runs the plots show, ``unscored`` why no score.

    ``faults`` tells of sensors that were declared ill, if there were any,
    ``odometer`` of a scale that was not believed. ``placeless`` says that nothing is at hand of what the places show.
    """

    name: str
    runs: int
    drawn: str
    wide: Tolerance
    narrow: Tolerance
    judged: str
    methods: tuple[str, ...]
    left_out: int
    tables: FigureTables | None
    unscored: str
    consistency: PageTable | None
    headline: Headline | None
    faults: str
    odometer: str
    plots: Drawings
    failures: tuple[FailureFrames, ...]
    places: tuple[PlaceFrames, ...]
    placeless: bool
    cost: PageTable | None
    has_costs: bool
    atlas: AtlasPart | None

    @property
    def heading(self) -> str:
        """Tolerance of the heading [degrees]."""
        return f"{math.degrees(self.wide.heading):g}"


def section(name: str, runs: Sequence[Comparison], settings: SectionSettings) -> Section:
    """Make a section of comparisons that differ in the seed only; the first that has true poses is drawn."""
    methods, wide, narrow = shared_methods(runs), settings.wide, settings.narrow
    number = first_with_truth(runs)
    drawn = runs[number]
    every = list(settings.figures or (figures(runs, wide, narrow) if methods else ()))
    unscored = unscored_reason(runs)
    scorable = bool(methods) and not unscored
    found = every if scorable else []
    judged = settings.judged if settings.judged in methods else _last(methods)
    shown = select_methods(methods, judged, {one.method: one.wide for one in found})
    by_run = next((one.wide_runs for one in found if one.method == judged), ())
    failures = worst_failures(runs, by_run, judged) if scorable else []
    path = path_of(drawn) if scorable else None
    failed, places = frames_of(runs, number, failures, path, wide, judged, settings.frames)
    selected = replace(drawn, beliefs={method: drawn.beliefs[method] for method in shown})
    return Section(
        name=name,
        runs=len(runs),
        drawn=_which(runs, number),
        wide=wide,
        narrow=narrow,
        judged=method_label(judged),
        methods=tuple(map(method_label, methods)),
        left_out=len(methods) - len(shown),
        tables=figure_tables(found, judged),
        unscored=unscored,
        consistency=consistency_page_table(every, judged),
        headline=next((headline(one, unscored, truth_estimates(runs)) for one in every if one.method == judged), None),
        faults=told_faults(declared_faults(drawn)),
        odometer=scale_words(drawn.beliefs.get(judged, ())),
        plots=drawings(selected, number, found, judged, (wide, narrow), settings.outline),
        failures=failed,
        places=places,
        placeless=settings.frames is None and _lacks_views(drawn),
        cost=cost_table(runs, methods, settings.costs),
        has_costs=bool(settings.costs),
        atlas=atlas_part(drawn, every, shown, judged, wide, settings.outline),
    )


def _lacks_views(run: Comparison) -> bool:
    """Tell whether a map of one path comes without what its places show: that of several has no such recording."""
    return len(run.stretches) == 1 and not any(view.sensors for view in run.reference_views)


def _last(methods: Sequence[str]) -> str:
    """The method that is drawn where none is judged: the thesis' last stage, or the last without any."""
    return next((stage for stage in reversed(Stage) if stage in methods), methods[-1] if methods else "")


def _which(runs: Sequence[Comparison], drawn: int) -> str:
    """Name the run that is ``drawn``, if there are several."""
    if len(runs) == 1:
        return ""
    seed = runs[drawn].query_metadata.get("seed")
    which = "first that has true poses" if drawn else "first"
    return f"the {which} of {len(runs)} runs" + (f" (query seed {seed})" if seed is not None else "")
