"""From a case that was judged to its record in the result file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.schema_types import schema_type_for
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask
from refseq_bench.scenarios.campaign.store.result_file import (
    CaseRecord,
    MethodRecord,
    MishapRecord,
    RunRecord,
    SeedRecord,
    ShareRecord,
)
from refseq_bench.scenarios.report.plot_selection import select_methods
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import Figures, figures_record
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.score import Score


def open_record(case: Case) -> CaseRecord:
    """The record of a case that has no verdict yet."""
    return CaseRecord(
        schema_type=schema_type_for(case.scenario).name,
        name=case.name,
        scenario=case.file.stem,
        file=_below_here(case.file),
        title=case.scenario.title,
        blocking=case.scenario.blocking,
        judged=case.scenario.judged,
        varied=dict(case.varied),
        resolved=case.scenario.model_dump(mode="json", exclude_none=True),
    )


def _below_here(file: Path) -> str | None:
    """A file as a CI server that started the campaign knows it; None of one that lies elsewhere."""
    there, here = file.resolve(), Path.cwd()
    return there.relative_to(here).as_posix() if there.is_relative_to(here) else None


def case_record(result: Judged, page: str) -> CaseRecord:
    """The record of a case; its ``page`` lies beside the file."""
    shown = select_methods(
        [one.method for one in result.figures],
        result.case.scenario.judged,
        {one.method: one.wide for one in result.figures},
    )
    return closed_record(
        result,
        page,
        views=sum(len(one.query_views) for one in result.comparisons),
        methods=tuple(_method(one, result, plotted=one.method in shown) for one in result.figures),
        seeds=_seeds(result.answered, result.comparisons),
    )


def closed_record(
    result: Judged, page: str, *, views: int, methods: tuple[MethodRecord, ...], seeds: Mapping[int, SeedRecord]
) -> CaseRecord:
    """The record of a case that has its verdict."""
    mishaps = (MishapRecord(verdict=one.verdict, reason=one.reason, details=one.details) for one in result.mishaps)
    found = {name: getattr(result, name) for name in ("verdict", "reasons", "unscored", "judgements", "seconds")}
    found |= {"page": page, "mishaps": tuple(mishaps), "views": views, "methods": methods, "seeds": seeds}
    return open_record(result.case).model_copy(update=found)


def _method(one: Figures, result: Judged, *, plotted: bool) -> MethodRecord:
    seeds = list(result.answered)
    costs = result.costs.get(one.method, ())
    return MethodRecord(
        method=one.method,
        plotted=plotted,
        within_m=one.wide.tolerance.distance,
        narrow_m=one.narrow.tolerance.distance,
        success=share_record(one.wide.success),
        success_narrow=share_record(one.narrow.success),
        figures=figures_record(one),
        costs=dict(zip(seeds, costs, strict=False)),
        digests=dict(zip(seeds, result.digests.get(one.method, ()), strict=False)),
        runs={seed: _run(run) for seed, run in zip(seeds, one.wide_runs, strict=True)},
    )


def _run(run: Score) -> RunRecord:
    curve, right = run.retrieval, run.success
    return RunRecord(right=right.successes, of=right.trials, auc=curve.auc if curve else None)


def share_record(share: Proportion) -> ShareRecord:
    """A share with its interval."""
    low, high = share.interval
    return ShareRecord(right=share.successes, of=share.trials, low=low, high=high)


def _seeds(answered: Mapping[int, Sequence[AnswerTask]], comparisons: Sequence[Comparison]) -> Mapping[int, SeedRecord]:
    return {
        seed: SeedRecord(
            reference=tasks[0].sources[0],
            further=tasks[0].sources[1:-1],
            query=tasks[0].sources[-1],
            answers={method: task.key for task in tasks for method in task.methods},
            learnt_views=len(run.reference_views),
            asked_views=len(run.query_views),
        )
        for (seed, tasks), run in zip(answered.items(), comparisons, strict=True)
    }
