"""Judging a case of missions: what the missions of all seeds came to, the figures, the expectations, the verdict."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.expectations import Expectation, about
from refseq_bench.scenarios.campaign.declare.mission_figures import MISSION_FIGURES
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome
from refseq_bench.scenarios.campaign.judge.drives import Judged, mishaps_of, reasons_of, verdict_of
from refseq_bench.scenarios.campaign.judge.expectations import judge
from refseq_bench.scenarios.campaign.judge.records import closed_record, share_record
from refseq_bench.scenarios.campaign.run.mission_task import MissionTask, mission_of
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.missions import KeptMission
from refseq_bench.scenarios.campaign.store.result_file import (
    CaseRecord,
    JudgementRecord,
    MethodRecord,
    RunRecord,
    SeedRecord,
)
from refseq_bench.scenarios.report.plot_selection import MOST
from refseq_bench.scenarios.scoring.missions import MissionFigures, MissionScore, mission_record, score_mission


@dataclass(frozen=True)
class JudgedMissions(Judged):
    """A case of missions that was run; figures and comparisons of localising there are none.

    ``missions`` are the figures of each method, ``kept`` what was run, by method and seed, ``led`` the tasks likewise.
    """

    missions: tuple[MissionFigures, ...] = ()
    kept: Mapping[str, Mapping[int, KeptMission]] = field(default_factory=dict)
    led: Mapping[str, Mapping[int, MissionTask]] = field(default_factory=dict)

    @property
    def verdict_alone(self) -> Judged:
        """The same without what only its page needs."""
        return replace(self, kept={}, led={})

    def score(self, method: str, seed: int) -> MissionScore:
        """One mission's score."""
        return _score(self.case, self.kept[method][seed])


def judged_missions(
    case: Case, tasks: Mapping[int, Sequence[MissionTask]], outcomes: Mapping[str, TaskOutcome], store: Store
) -> JudgedMissions:
    """Judge a case by what its tasks left in the store; ``outcomes`` are by key, those of recordings among them."""
    mishaps = mishaps_of(tasks, outcomes)
    led: dict[str, dict[int, MissionTask]] = {}
    for seed, of_seed in tasks.items():
        for task in of_seed:
            if outcomes[task.key].good:
                led.setdefault(task.method, {})[seed] = task
    kept = {m: {seed: mission_of(task, store) for seed, task in of_method.items()} for m, of_method in led.items()}
    order = [method for method in case.scenario.methods if method in kept]
    found = [MissionFigures(m, tuple(_score(case, one) for one in kept[m].values())) for m in order]
    judgements = tuple(_judgement(one, case, kept) for one in case.expectations)
    return JudgedMissions(
        case=case,
        verdict=verdict_of(mishaps, judgements),
        reasons=reasons_of(mishaps, judgements),
        judgements=judgements,
        figures=(),
        comparisons=(),
        costs=MappingProxyType({m: tuple(one.cost for one in kept[m].values()) for m in order}),
        digests=MappingProxyType({m: tuple(one.digest for one in kept[m].values()) for m in order}),
        seconds=math.fsum(outcomes[task.key].seconds for of_seed in tasks.values() for task in of_seed),
        mishaps=tuple(mishaps),
        missions=tuple(found),
        kept=MappingProxyType({method: kept[method] for method in order}),
        led=MappingProxyType({method: led[method] for method in order}),
    )


def _judgement(expectation: Expectation, case: Case, kept: Mapping[str, Mapping[int, KeptMission]]) -> JudgementRecord:
    """Judge by the seeds at which all methods that it names ran to the end, and by no others.

    A worker that broke is then nobody's failure, and no method is compared with another one's harder seeds.
    """
    named = about(expectation, case.scenario.judged).methods
    ran = {method: of_method for method, of_method in kept.items() if method in named} or kept
    seeds = [seed for seed in case.scenario.seeds if ran and all(seed in of_method for of_method in ran.values())]
    found = {
        m: MissionFigures(m, tuple(_score(case, of_method[seed]) for seed in seeds)) for m, of_method in ran.items()
    }
    return judge(expectation, found, case.scenario.judged, len(seeds), MISSION_FIGURES)


def _score(case: Case, one: KeptMission) -> MissionScore:
    return score_mission(one.run, case.scenario.score.within, case.scenario.score.narrow)


def missions_record(result: JudgedMissions, page: str) -> CaseRecord:
    """The record of a case; its ``page`` lies beside the result file."""
    names = [one.method for one in result.missions]
    shown = sorted(names, key=lambda name: name != result.case.scenario.judged)[:MOST]
    return closed_record(
        result,
        page,
        views=sum(one.views for one in result.missions),
        methods=tuple(_method(one, result, plotted=one.method in shown) for one in result.missions),
        seeds=_seeds(result),
    )


def _method(one: MissionFigures, result: JudgedMissions, *, plotted: bool) -> MethodRecord:
    kept, terms = result.kept[one.method], result.case.scenario.score
    return MethodRecord(
        method=one.method,
        plotted=plotted,
        within_m=terms.within,
        narrow_m=terms.narrow,
        success=share_record(one.completed),
        success_narrow=share_record(one.completed_narrow),
        figures=mission_record(one),
        costs={seed: each.cost for seed, each in kept.items()},
        digests={seed: each.digest for seed, each in kept.items()},
        runs={seed: RunRecord(right=int(result.score(one.method, seed).completed), of=1) for seed in kept},
    )


def _seeds(result: JudgedMissions) -> Mapping[int, SeedRecord]:
    found: dict[int, SeedRecord] = {}
    for seed in result.case.scenario.seeds:
        of_seed = {method: tasks[seed] for method, tasks in result.led.items() if seed in tasks}
        if not of_seed:
            continue
        # What is judged drove in the light that was asked for; a method that sees nothing was spared the images.
        sources = of_seed.get(result.case.scenario.judged, next(iter(of_seed.values()))).sources
        found[seed] = SeedRecord(
            reference=sources[0],
            further=sources[1:-1],
            query=sources[-1],
            answers={method: task.key for method, task in of_seed.items()},
            learnt_views=max(result.kept[method][seed].cost.places for method in of_seed),
            asked_views=sum(result.kept[method][seed].run.views for method in of_seed),
        )
    return found
