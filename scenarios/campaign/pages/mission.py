"""The page of a case of missions: verdict, figures, what became of each mission, plans, orders, logs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from refseq_bench.scenarios.campaign.judge.missions import JudgedMissions
from refseq_bench.scenarios.campaign.pages.case import outline_of_query, verdict_parts
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord
from refseq_bench.scenarios.report.page import PageRow, PageTable, rendered
from refseq_bench.scenarios.report.plots.mission import mission_plan
from refseq_bench.scenarios.report.plots.plan import FloorOutline
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.report.words import metres
from refseq_bench.scenarios.scoring.missions import MissionFigures, MissionRun, MissionScore, outcome_words
from refseq_bench.scenarios.tables import NONE

HEADINGS = (
    "to the goal, median",
    "wrong switches",
    "things touched",
    "time, median",
    "time over ideal",
    "BARN",
    "said lost",
    "views",
)


@dataclass(frozen=True)
class OutcomeRow:
    """Outcome of one mission, in words; ``good`` where it was completed."""

    seed: int
    method: str
    good: bool
    outcome: str
    touched: str
    wrong: str


@dataclass(frozen=True)
class OrderRow:
    """An order of a plan: from where on, what, why, and when it was begun."""

    at: str
    behaviour: str
    why: str
    begun: str


@dataclass(frozen=True)
class MissionDetail:
    """A mission that is shown whole."""

    title: str
    good: bool
    plan: Plot
    orders: tuple[OrderRow, ...]
    log: str


def mission_page(result: JudgedMissions, record: CaseRecord, campaign: CampaignRecord) -> str:
    """The page of a case that was judged; ``campaign`` tells of the versions and the machine."""
    return rendered(
        "mission.html.j2",
        **verdict_parts(result, record, campaign),
        it=None,
        figures=_table(result),
        outcomes=[_outcome(result, method, seed) for method, seed in _all(result)],
        shown=_shown(result),
        terms=result.case.scenario.score,
        facts=(),
        details=(),
    )


def _all(result: JudgedMissions) -> Iterator[tuple[str, int]]:
    return ((method, seed) for method, of_method in result.kept.items() for seed in of_method)


def _table(result: JudgedMissions) -> PageTable | None:
    """The figures of all methods; None where no mission was run."""
    score = result.case.scenario.score
    completed = (f"completed, within {score.within} m", f"within {score.narrow} m")
    rows = tuple(_row(one, result) for one in result.missions)
    return PageTable(("led by", *completed, *HEADINGS), rows) if rows else None


def _row(one: MissionFigures, result: JudgedMissions) -> PageRow:
    cells = (
        f"{one.completed.successes} of {len(one.scores)}",
        f"{one.completed_narrow.successes} of {len(one.scores)}",
        metres(one.goal_distance),
        NONE if math.isnan(one.wrong_switches) else f"{one.wrong_switches:.0f} of {one.switches}",
        str(one.collisions),
        NONE if math.isnan(one.time) else f"{one.time:.0f} s",
        NONE if math.isnan(one.time_over_ideal) else f"{one.time_over_ideal:.2f}",
        f"{one.barn:.3f}",
        str(one.lost),
        str(one.views),
    )
    return PageRow(one.method, cells, one.method == result.case.scenario.judged)


def _outcome(result: JudgedMissions, method: str, seed: int) -> OutcomeRow:
    run, score = result.kept[method][seed].run, result.score(method, seed)
    wrong = NONE if score.wrong is None else ", ".join(_wrong(run, score)) or "none"
    outcome = outcome_words(run, score)
    return OutcomeRow(seed, method, score.completed, outcome, ", ".join(run.touched) or "nothing", wrong)


def _wrong(run: MissionRun, score: MissionScore) -> Iterator[str]:
    """The switches that were wrong ones, as they are numbered in the plan."""
    for number, ((order, time), wrong) in enumerate(zip(run.switches, score.wrong or (), strict=True), 1):
        if wrong:
            yield f"{number} ({run.orders[order].behaviour}, {time:.0f} s)"


def _shown(result: JudgedMissions) -> list[MissionDetail]:
    """Every mission that was not completed, and one that was: the judged method's, if there is one."""
    outline, within = outline_of_query(result.case, result.case.scenario.seeds[0]), result.case.scenario.score.within
    good = sorted(
        (pair for pair in _all(result) if result.score(*pair).completed),
        key=lambda pair: pair[0] != result.case.scenario.judged,
    )
    chosen = [*good[:1], *(pair for pair in _all(result) if not result.score(*pair).completed)]
    return [_whole(result, method, seed, within, outline) for method, seed in chosen]


def _whole(
    result: JudgedMissions, method: str, seed: int, within: float, outline: FloorOutline | None
) -> MissionDetail:
    run, score = result.kept[method][seed].run, result.score(method, seed)
    begun: dict[int, list[str]] = {}
    for number, (order, time) in enumerate(run.switches, 1):
        begun.setdefault(order, []).append(f"{number} at {time:.0f} s")
    return MissionDetail(
        title=f"{method}, seed {seed}: {outcome_words(run, score)}",
        good=score.completed,
        plan=mission_plan(run, score, within, outline),
        orders=tuple(
            OrderRow(
                NONE if math.isnan(one.at) else f"{one.at:.1f} m", one.behaviour, one.why, ", ".join(begun.get(n, ()))
            )
            for n, one in enumerate(run.orders)
        ),
        log="\n".join(map(str, run.log)),
    )
