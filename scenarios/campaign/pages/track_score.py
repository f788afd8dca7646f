"""Score of a method over all cases of a scenario: the mean area under precision and recall, with its interval."""

from collections.abc import Sequence
from statistics import fmean

from refseq_bench.scenarios.campaign.store.result_file import CaseRecord, MethodRecord, ShareRecord
from refseq_bench.scenarios.scoring.intervals.bootstrap import middle, resamples
from refseq_bench.scenarios.scoring.proportion import Proportion

ALL = "*"
"""Stands for all cases, behind a scenario's name."""


def scored_together(cases: Sequence[CaseRecord]) -> CaseRecord:
    """All cases of a scenario, which have the same seeds, as one, with the methods that answered some of them.

    Each seed counts with the mean over the cases, in which a case that a method did not answer has no right answer.
    ``score_shared`` is the mean over the ``cases_shared`` alone, which all these methods answered; none without any.
    """
    seeds = {seed: record for case in cases for seed, record in case.seeds.items()}
    methods = dict.fromkeys(one.method for case in cases for one in case.methods)
    shared = [case for case in cases if all(case.method(method) for method in methods)]
    declared = list(dict.fromkeys(seed for case in cases for seed in declared_seeds(case)))
    scored = tuple(_scored(method, cases, shared, declared) for method in methods)
    return cases[0].model_copy(update={"name": f"{cases[0].scenario}/{ALL}", "methods": scored, "seeds": seeds})


def declared_seeds(case: CaseRecord) -> tuple[int, ...]:
    """The seeds that a case was run for, those among them that nobody answered."""
    return tuple(case.resolved.get("seeds", case.seeds))


def _scored(
    method: str, cases: Sequence[CaseRecord], shared: Sequence[CaseRecord], seeds: Sequence[int]
) -> MethodRecord:
    found = [case.method(method) for case in cases]
    answered = [one for one in found if one]
    by_seed = [fmean(_area(one, seed) for one in found) for seed in seeds]
    bounds = seeds_interval(by_seed) or (None, None)
    score = {"score": fmean(by_seed), "score_low": bounds[0], "score_high": bounds[1], "cases": len(cases)}
    areas = [_area(case.method(method), seed) for case in shared for seed in seeds]
    score |= {"score_shared": fmean(areas) if areas else None, "cases_shared": len(shared)}
    shares = {name: _pooled([getattr(one, name) for one in answered]) for name in ("success", "success_narrow")}
    return answered[0].model_copy(update={**shares, "figures": score, "runs": {}, "costs": {}, "digests": {}})


def _pooled(shares: Sequence[ShareRecord]) -> ShareRecord:
    found = Proportion.pooled(Proportion(one.right, one.of) for one in shares)
    low, high = found.interval
    return ShareRecord(right=found.successes, of=found.trials, low=low, high=high)


def _area(one: MethodRecord | None, seed: int) -> float:
    run = one.runs.get(seed) if one else None
    return run.auc if run and run.auc is not None else 0.0


def seeds_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """The middle 95 % of the mean over resamples of the seeds; None of one seed."""
    if len(values) < 2:
        return None
    return middle([(fmean(values[k] for k in chosen), weight) for chosen, weight in resamples(len(values))])
