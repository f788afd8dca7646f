"""Judging a case: the answers of all its seeds, the figures, the expectations, the verdict."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from refseq.belief import Belief
from refseq.view import View
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.sources import names_of
from refseq_bench.scenarios.campaign.judge.expectations import judge
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, Question, answers_of, asked_views, learnt_drives
from refseq_bench.scenarios.campaign.store.answers import beliefs_digest
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import JudgementRecord
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.figures import Figures, figures
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.path_geometry import Tolerance
from refseq_bench.scenarios.scoring.truth import unscored_reason


@dataclass(frozen=True)
class Judged:
    """A case that was run: its verdict, why, and all that decided.

    ``reasons`` are one line each: what kept methods from answering, what was missed, what could not be judged.
    ``costs`` and ``digests`` (of the beliefs, bit for bit, times aside) are by method, one entry a seed that was
    answered. ``comparisons`` hold one entry a seed with all methods that answered; ``seconds`` is what the tasks took
    on the wall clock, those that were kept from an earlier run not counted.

    ``mishaps`` are the tasks that did not end well, each reason once. ``answered`` are by seed the tasks that did, of
    those seeds that have a comparison, in their order. ``unscored`` says why no view could be judged, empty where some
    were.
    """

    case: Case
    verdict: Verdict
    reasons: tuple[str, ...]
    judgements: tuple[JudgementRecord, ...]
    figures: tuple[Figures, ...]
    comparisons: tuple[Comparison, ...]
    costs: Mapping[str, tuple[Cost, ...]]
    digests: Mapping[str, tuple[str, ...]]
    seconds: float
    unscored: str = ""
    mishaps: tuple[TaskOutcome, ...] = ()
    answered: Mapping[int, tuple[AnswerTask, ...]] = field(default_factory=dict)

    @property
    def verdict_alone(self) -> "Judged":
        """The same without what only its page needs: that of a whole campaign would fill the memory."""
        return replace(self, comparisons=())


def judged(
    case: Case, tasks: Mapping[int, Sequence[AnswerTask]], outcomes: Mapping[str, TaskOutcome], store: Store
) -> Judged:
    """Judge a case by what its tasks left in the store; ``outcomes`` are by key, those of recordings among them."""
    mishaps = mishaps_of(tasks, outcomes)
    good = {seed: tuple(task for task in of_seed if outcomes[task.key].good) for seed, of_seed in tasks.items()}
    answered = {seed: done for seed, done in good.items() if done}
    runs = {seed: _answers_of_seed(case, done, store) for seed, done in answered.items()}
    comparisons = tuple(run.comparison for run in runs.values())
    found = figures(comparisons, *tolerances(case)) if comparisons else []
    by_method = {one.method: one for one in found}
    unscored = unscored_reason(comparisons)
    judgements = tuple(
        judge(one, by_method, case.scenario.judged, len(runs), unscored=unscored) for one in case.expectations
    )
    methods = [one.method for one in found]
    return Judged(
        case=case,
        verdict=verdict_of(mishaps, judgements),
        reasons=reasons_of(mishaps, judgements),
        judgements=judgements,
        figures=tuple(found),
        comparisons=comparisons,
        costs=MappingProxyType({m: tuple(run.costs[m] for run in runs.values()) for m in methods}),
        digests=MappingProxyType({m: tuple(run.digests[m] for run in runs.values()) for m in methods}),
        seconds=math.fsum(outcomes[task.key].seconds for of_seed in tasks.values() for task in of_seed),
        unscored=unscored,
        mishaps=tuple(mishaps),
        answered=MappingProxyType(answered),
    )


def mishaps_of(tasks: Mapping[int, Sequence[Question]], outcomes: Mapping[str, TaskOutcome]) -> list[TaskOutcome]:
    """Outcomes that are not good, each reason once, with the seeds where there are others."""
    found: dict[str, TaskOutcome] = {}
    seeds: dict[str, list[int]] = {}
    for seed, of_seed in tasks.items():
        for outcome in (outcomes[task.key] for task in of_seed):
            if not outcome.good:
                found.setdefault(outcome.reason, outcome)
                seeds.setdefault(outcome.reason, []).append(seed)
    return [
        replace(one, reason=f"{reason} ({_of_seeds(seeds[reason])})") if len(set(seeds[reason])) < len(tasks) else one
        for reason, one in found.items()
    ]


def _of_seeds(seeds: Sequence[int]) -> str:
    named = sorted(set(seeds))
    return f"seed{'s' if len(named) > 1 else ''} {', '.join(map(str, named))}"


def reasons_of(mishaps: Sequence[TaskOutcome], judgements: Sequence[JudgementRecord]) -> tuple[str, ...]:
    """Why a case has its verdict, a line each."""
    missed = [f"missed: {one.text} ({one.explanation})" for one in judgements if one.met is False]
    broken = [f"cannot be judged: {one.text} ({one.reason})" for one in judgements if one.broken]
    open_ = [f"not judged: {one.text} ({one.reason})" for one in judgements if one.met is None and not one.broken]
    return (*(outcome.reason for outcome in mishaps), *broken, *missed, *open_)


def verdict_of(mishaps: Sequence[TaskOutcome], judgements: Sequence[JudgementRecord]) -> Verdict:
    """An error weighs more than a failure, a failure more than what was not there to be run.

    A case of which no expectation could be judged has not passed: fewer seeds were run, or other methods.
    """
    kinds = {one.verdict for one in mishaps}
    if any(one.broken for one in judgements):
        kinds.add(Verdict.ERROR)
    if any(one.met is False for one in judgements):
        kinds.add(Verdict.FAILED)
    if judgements and all(one.met is None for one in judgements):
        kinds.add(Verdict.SKIPPED)
    return next((kind for kind in (Verdict.ERROR, Verdict.FAILED, Verdict.SKIPPED) if kind in kinds), Verdict.PASSED)


def tolerances(case: Case) -> tuple[Tolerance, Tolerance]:
    """The tolerance of a right answer that decides, and the narrower one."""
    asked = case.scenario.score
    heading = math.radians(asked.heading)
    return Tolerance(asked.within, heading), Tolerance(asked.narrow, heading)


@dataclass(frozen=True)
class _SeedAnswers:
    """One seed: what was answered, what it cost, and the digest of the beliefs, by method."""

    comparison: Comparison
    costs: Mapping[str, Cost]
    digests: Mapping[str, str]


def _answers_of_seed(case: Case, tasks: Sequence[AnswerTask], store: Store) -> _SeedAnswers:
    drives, query = learnt_drives(tasks[0], store), asked_views(tasks[0], store)
    mergings: dict[str, Merging] = {}
    beliefs: dict[str, Sequence[Belief]] = {}
    costs: dict[str, Cost] = {}
    for task in tasks:
        kept = answers_of(task, store)
        beliefs |= kept.beliefs
        costs |= dict.fromkeys(kept.beliefs, kept.cost)
        mergings |= kept.mergings
    order = [method for method in case.scenario.methods if method in beliefs]
    comparison = Comparison(
        case.name,
        [_without_images(view) for drive in drives for view in drive.views],
        drives[0].metadata,
        [_without_images(view) for view in query.views],
        query.metadata,
        {method: beliefs[method] for method in order},
        Drives(names_of(tasks[0].references), tuple(len(drive.views) for drive in drives)),
        mergings,
    )
    return _SeedAnswers(comparison, costs, {method: beliefs_digest(beliefs[method]) for method in order})


def _without_images(view: View) -> View:
    """Ten drives with their images would fill the memory; whoever shows one reads it again."""
    return replace(view, images={})
