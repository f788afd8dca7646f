"""Choose judging, record and page of a case by its type: localising or missions.

Here, and nowhere else, it is chosen which; what a scenario may say:
``refseq_bench.scenarios.campaign.declare.schema_types``.
"""

from collections.abc import Mapping, Sequence
from typing import cast

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome
from refseq_bench.scenarios.campaign.declare.schema import MissionScenario
from refseq_bench.scenarios.campaign.judge import drives, records
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.judge.missions import JudgedMissions, judged_missions, missions_record
from refseq_bench.scenarios.campaign.pages import case as localising_page
from refseq_bench.scenarios.campaign.pages.mission import mission_page
from refseq_bench.scenarios.campaign.run.mission_task import MissionTask
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, Question
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord


def judged(
    case: Case, tasks: Mapping[int, Sequence[Question]], outcomes: Mapping[str, TaskOutcome], store: Store
) -> Judged:
    """Judge a case by what its tasks left in the store; ``outcomes`` are by key, those of recordings among them."""
    if _is_mission(case):
        return judged_missions(case, cast(Mapping[int, Sequence[MissionTask]], tasks), outcomes, store)
    return drives.judged(case, cast(Mapping[int, Sequence[AnswerTask]], tasks), outcomes, store)


def case_record(result: Judged, page: str) -> CaseRecord:
    """The record of a case; its ``page`` lies beside the file."""
    return missions_record(result, page) if isinstance(result, JudgedMissions) else records.case_record(result, page)


def case_page(result: Judged, record: CaseRecord, campaign: CampaignRecord, store: Store) -> str:
    """The page of a case that was judged; ``campaign`` tells of the versions and the machine."""
    if isinstance(result, JudgedMissions):
        return mission_page(result, record, campaign)
    return localising_page.case_page(result, record, campaign, store)


def _is_mission(case: Case) -> bool:
    return isinstance(case.scenario, MissionScenario)
