"""The worst failures of a method over several drives: what somebody who wants to know why looks at first."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, path_of
from refseq_bench.scenarios.scoring.score import Score

KINDS = (Outcome.WRONG, Outcome.FALSE_FIX, Outcome.MISSED)
EACH = 2
"""Failures of each kind that are shown."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A view that a method failed at: the ``run`` by its number, the query ``view``, and what became of it.

    ``answer`` is the place answered (or that would have been, of a view that was missed) and ``right`` the place
    nearest to the truth; ``apart`` is how far the answer's place is from the truth [m], nan where that place has no
    true pose, ``lost`` the P(lost) said. ``views`` in a row were failed at in this way, of which this is the worst.
    """

    run: int
    view: int
    outcome: Outcome
    answer: int
    right: int
    apart: float
    lost: float
    views: int


def worst_failures(
    comparisons: Sequence[Comparison], scores: Sequence[Score], method: str, each: int = EACH
) -> list[Failure]:
    """The worst of each kind, wrong answers first; of views in a row that failed alike only the worst one.

    Wrong answers and false fixes are the worse the farther they lie from the truth, and worst where nobody knows how
    far; missed views the surer the localiser was of being lost. ``scores`` are of the comparisons, one by one.
    """
    found = [
        failure
        for run, (comparison, score) in enumerate(zip(comparisons, scores, strict=True))
        for failure in _of_run(run, comparison, score, method)
    ]
    return [failure for kind in KINDS for failure in _worst([one for one in found if one.outcome is kind])[:each]]


def _worst(failures: Sequence[Failure]) -> list[Failure]:
    return sorted(failures, key=lambda one: (-_badness(one), one.run, one.view))


def _badness(failure: Failure) -> float:
    if failure.outcome is Outcome.MISSED:
        return failure.lost
    return math.inf if math.isnan(failure.apart) else failure.apart


def _of_run(run: int, comparison: Comparison, score: Score, method: str) -> Iterator[Failure]:
    """The worst failure of each stretch of views in a row that failed alike."""
    path = path_of(comparison)
    for outcome, stretch in groupby(range(len(score.outcomes)), key=lambda t: score.outcomes[t]):
        if outcome in KINDS:
            views = list(stretch)
            failures = [_failure(run, t, comparison, outcome, path, method, len(views)) for t in views]
            yield _worst(failures)[0]


def _failure(
    run: int, t: int, comparison: Comparison, outcome: Outcome, path: ReferencePath, method: str, views: int
) -> Failure:
    truth, belief = comparison.query_views[t].truth, comparison.beliefs[method][t]
    right = path.nearest(truth)
    assert truth is not None  # a view without a true pose has no outcome that is a failure
    assert right is not None
    return Failure(run, t, outcome, belief.best, right, path.apart(belief.best, truth), belief.lost, views)
