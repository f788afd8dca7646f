"""The page of a case: its verdict, what decided, what was answered and seen."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.judge.drives import Judged, tolerances
from refseq_bench.scenarios.campaign.pages.decisive import compared, comparison_rows, seeds_words, undecided
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, asked_views, learnt_drives
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, JudgementRecord
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.route import plan_of
from refseq_bench.scenarios.report.document import details, facts
from refseq_bench.scenarios.report.page import rendered
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.report.sections.experiment import Section, SectionSettings, section
from refseq_bench.scenarios.report.sections.frames import DriveRole, EncodedFrames, FrameRequest, encoded
from refseq_bench.scenarios.report.words import duration_text
from refseq_bench.worlds.drawing.outline import outline_of
from refseq_bench.worlds.errors import WorldsError


@dataclass(frozen=True)
class ExpectationRow:
    """An expectation in words: its verdict, what is written, what decided."""

    verdict: str
    text: str
    explanation: str


def case_page(result: Judged, record: CaseRecord, campaign: CampaignRecord, store: Store) -> str:
    """The page of a case that was judged; ``campaign`` tells of the versions and the machine."""
    return rendered(
        "case.html.j2",
        **verdict_parts(result, record, campaign),
        it=_section(result, store),
        facts=facts(result.comparisons),
        details=details(result.comparisons),
    )


def verdict_parts(result: Judged, record: CaseRecord, campaign: CampaignRecord) -> dict[str, object]:
    """Parts of a page that cases of all types have: verdict, expectations, traces, the resolved scenario."""
    return {
        "title": f"{record.name}: {record.verdict_word}",
        "case": record,
        "scenario": result.case.scenario,
        "expectations": [_expectation_row(one) for one in record.judgements],
        "traces": [(one.reason, one.details) for one in record.mishaps if one.details],
        "resolved": json.dumps(record.resolved, indent=2, ensure_ascii=False),
        "seconds": duration_text(record.seconds),
        "campaign": campaign,
        "undecided": undecided(record),
        "comparisons": comparison_rows(record),
        "compared_seeds": seeds_words(compared(record)),
    }


def _expectation_row(one: JudgementRecord) -> ExpectationRow:
    """An expectation and what decided, in words."""
    open_ = Verdict.ERROR if one.broken else Verdict.SKIPPED
    verdict = {True: Verdict.PASSED, False: Verdict.FAILED, None: open_}[one.met]
    return ExpectationRow(verdict.value, one.text, ("not judged: " if one.met is None else "") + one.explanation)


def _section(result: Judged, store: Store) -> Section | None:
    """Section of the drives and their answers; None where no drive was answered."""
    if not result.comparisons:
        return None
    settings = SectionSettings(
        *tolerances(result.case),
        judged=result.case.scenario.judged,
        costs=result.costs,
        frames=FromStore([tasks[0] for tasks in result.answered.values()], store),
        outline=outline_of_query(result.case, next(iter(result.answered))),
        figures=result.figures,
    )
    return section(result.case.name, result.comparisons, settings)


def outline_of_query(case: Case, seed: int) -> FloorOutline | None:
    """The walls, where the query is driven in a floor plan; doors and things as on its day."""
    query = case.source("query", seed)
    try:
        return outline_of(plan_of(query)) if isinstance(query, Drive) else None
    except WorldsError:
        return None  # a plan that was taken away after the drive


class FromStore:
    """Frames that lie in the store, of runs by their ``tasks``; all drives at once would fill the memory."""

    def __init__(self, tasks: Sequence[AnswerTask], store: Store) -> None:
        self._tasks, self._store = tasks, store

    def __call__(self, requests: Sequence[FrameRequest]) -> EncodedFrames:
        """The frames of some views, by camera."""
        found: dict[FrameRequest, dict[str, str]] = {}
        for run, role in dict.fromkeys((one.run, one.role) for one in requests):
            task = self._tasks[run]
            drives = (
                learnt_drives(task, self._store) if role is DriveRole.REFERENCE else [asked_views(task, self._store)]
            )
            views = [view for drive in drives for view in drive.views]
            found |= encoded(views, [one for one in requests if (one.run, one.role) == (run, role)])
        return found
