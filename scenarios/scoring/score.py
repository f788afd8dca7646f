"""Score a localiser's answers against the truth: outcomes, errors, and how sure they were.

A query view is *on the map* when some reference view lies within the tolerance of its true pose. The answer to a view
is ``belief.best``, unless ``belief.lost`` is above ``LOST_ABOVE``: then the localiser says that it is lost. An answer
is right when its reference pose lies within the tolerance of the true pose. A view without a true pose is not scored,
only counted; a reference view without one can be nobody's right answer. Where no reference view has one, no view is
scored.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq.inference.matching.information import posterior_information, proven_information
from refseq.planar import Pose
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.metrics import (
    Reliability,
    Retrieval,
    auroc,
    false_positive_rate,
    reliability,
    retrieval,
)
from refseq_bench.scenarios.scoring.outcome import OFF_MAP, ON_MAP, Outcome, judge
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath, Tolerance, path_of
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.recovery import DistanceOrNever, Recovery, first_fix, recovery_of

RANKS = (1, 5, 10)
"""Numbers of most probable places for which recall is told."""

PLACES_OFF = (1, 2, 5)
"""Numbers of places by which an answer may be off, for which success by places is told."""


@dataclass(frozen=True)
class Score:
    """The views of one run or of several pooled ones, judged at one tolerance; arrays have one entry a view.

    ``errors`` [m] is the signed distance along the reference path from the true position to the answer, ``nan`` where
    no answer was due or given (lost, off the map, without truth). ``false_fixes`` [m] is how far from the true position
    the answer of a false fix lies, ``nan`` elsewhere. Both are ``nan`` as well where the answer is a place without a
    true pose: ``outcomes`` count what was answered, never these. ``ranks`` is where the first right place stands among
    all places, the most probable being 1, lost or not, and infinite where no place is right; ``mass`` is the
    probability of all places within the tolerance of the top one. ``places_off`` is by how many places an answer on the
    map is ahead of the one nearest to the truth, ``nan`` as in ``errors``; ``entropies`` [nats] are those of the
    beliefs. ``posterior_bits`` is the information about the place that each posterior claims, ``proven_bits`` what the
    true place leaves of that, ``nan`` off the map. ``last_sure`` [m] is how far the place at which a localiser that
    says lost off the map was last sure lies from where it was on the map at last, ``nan`` elsewhere and where it does
    not tell. ``first_fixes`` [m] holds for each run the distance travelled to its first right answer, ``None`` where
    there was none; ``recovery`` the distances of all runs.

    Where several drives were learnt, these distances and numbers of places are along the one that the answer is on. If
    that does not come by, the error is the straight distance, and the number of places infinite.
    """

    tolerance: Tolerance
    outcomes: tuple[Outcome, ...]
    errors: NDArray[np.float64]
    false_fixes: NDArray[np.float64]
    lost: NDArray[np.float64]
    top: NDArray[np.float64]
    ranks: NDArray[np.float64]
    mass: NDArray[np.float64]
    places_off: NDArray[np.float64]
    entropies: NDArray[np.float64]
    posterior_bits: NDArray[np.float64]
    proven_bits: NDArray[np.float64]
    last_sure: NDArray[np.float64]
    first_fixes: tuple[DistanceOrNever, ...]
    recovery: Recovery

    def count(self, *outcomes: Outcome) -> int:
        """Count the views with one of these outcomes."""
        return sum(self.outcomes.count(outcome) for outcome in outcomes)

    @property
    def on_map(self) -> NDArray[np.bool_]:
        """Mark the views on the map."""
        return np.isin(self.outcomes, ON_MAP)

    @property
    def off_map(self) -> NDArray[np.bool_]:
        """Mark the views with a true pose that no reference view is near to."""
        return np.isin(self.outcomes, OFF_MAP)

    @property
    def scored(self) -> int:
        """Number of views that could be judged: those with a true pose, where the reference drive has some."""
        return len(self.outcomes) - self.count(Outcome.UNSCORED)

    @property
    def last_sure_median(self) -> float:
        """Median of ``last_sure`` [m], ``nan`` where it was never told."""
        told = self.last_sure[np.isfinite(self.last_sure)]
        return float(np.median(told)) if len(told) else math.nan

    @property
    def success(self) -> Proportion:
        """Right answers among all views on the map; a missed one counts against it."""
        return Proportion(self.count(Outcome.RIGHT), int(self.on_map.sum()))

    @property
    def accuracy(self) -> Proportion:
        """Right answers on the map and rejected views off it, among all: a false fix counts as much as a failure."""
        return Proportion(self.count(Outcome.RIGHT, Outcome.REJECTED), self.scored)

    @property
    def failures(self) -> int:
        """Failures as the thesis counts them: wrong and missed."""
        return self.count(Outcome.WRONG, Outcome.MISSED)

    def error_quantile(self, share: float) -> float:
        """Quantile of the absolute along-path error over the answers given on the map [m], ``nan`` without any.

        Only errors that are known count; ``unknown_errors`` says how many more there are.
        """
        errors = np.abs(self.errors[np.isfinite(self.errors)])
        return float(np.quantile(errors, share)) if len(errors) else math.nan

    @property
    def unknown_errors(self) -> int:
        """Number of answers on the map whose error nobody knows: no true pose is where they point."""
        return self.count(Outcome.RIGHT, Outcome.WRONG) - int(np.isfinite(self.errors).sum())

    @property
    def unknown_false_fixes(self) -> int:
        """Number of answers off the map whose distance nobody knows."""
        return self.count(Outcome.FALSE_FIX) - int(np.isfinite(self.false_fixes).sum())

    def recall(self, first: int) -> Proportion:
        """Views with a right place among their ``first`` most probable ones, of all on the map (recall@N)."""
        return Proportion(int((self.ranks[self.on_map] <= first).sum()), int(self.on_map.sum()))

    def within_places(self, count: int) -> Proportion:
        """Answers at most ``count`` places from the one nearest to the truth, of all views on the map.

        A unit of its own beside metres: nothing is asked of the distance, and a missed view counts against it.
        """
        near = np.abs(self.places_off[self.on_map]) <= count
        return Proportion(int(near.sum()), int(self.on_map.sum()))

    @property
    def entropy_auroc(self) -> float | None:
        """Chance that a wrong answer's belief has more entropy than a right one's; ``None`` unless both exist."""
        outcomes = np.array(self.outcomes)
        wrong, right = outcomes == Outcome.WRONG, outcomes == Outcome.RIGHT
        return auroc(self.entropies[wrong], self.entropies[right]) if len(self.outcomes) else None

    @property
    def information(self) -> float:
        """Information about the place that the posteriors claim, a view's mean [bits], ``nan`` without views."""
        return _mean(self.posterior_bits)

    @property
    def proven_information(self) -> float:
        """Information that the true places prove [bits]: more than claimed means too little trust, less too much.

        Below zero a uniform answer would have been better; ``nan`` without a view on the map.
        """
        return _mean(self.proven_bits[self.on_map])

    @property
    def worst_false_fix(self) -> float:
        """Farthest that an answer off the map lay from where the robot was [m], 0 where all views off it are rejected.

        ``nan`` where no view is off the map, or no false fix' distance is known.
        """
        if self.off_map.any() and not self.count(Outcome.FALSE_FIX):
            return 0.0
        return float(np.nanmax(self.false_fixes)) if np.isfinite(self.false_fixes).any() else math.nan

    @property
    def auroc(self) -> float | None:
        """Area under the ROC curve of P(lost) for being off the map; ``None`` unless views of both kinds exist."""
        return auroc(self.lost[self.off_map], self.lost[self.on_map])

    @property
    def false_alarms(self) -> float | None:
        """Share of the views on the map that P(lost) would give up to catch 95 % of those off it (FPR@95TPR)."""
        return false_positive_rate(self.lost[self.off_map], self.lost[self.on_map], 0.95)

    @property
    def mass_reliability(self) -> Reliability:
        """The probability around the top place over the views on the map, and how often that place was right.

        The top place's own is no match for the event: its neighbours within the tolerance share what is believed of it.
        """
        return reliability(self.mass[self.on_map], (self.ranks == 1)[self.on_map])

    @property
    def lost_reliability(self) -> Reliability:
        """P(lost) over all views with a true pose, and how often they were off the map."""
        scored = self.on_map | self.off_map
        return reliability(self.lost[scored], self.off_map[scored])

    @cached_property
    def retrieval(self) -> Retrieval | None:
        """Precision and recall of the answers by their score; ``None`` without a view on the map."""
        scored = self.on_map | self.off_map
        if not self.on_map.any():
            return None
        return retrieval(((1 - self.lost) * self.top)[scored], (self.ranks == 1)[scored], int(self.on_map.sum()))


def _mean(values: NDArray[np.float64]) -> float:
    return float(values.mean()) if len(values) else math.nan


class _Row(NamedTuple):
    """A view's entries in the arrays of ``Score``, by their names there."""

    errors: float
    false_fixes: float
    lost: float
    top: float
    ranks: float
    places_off: float
    entropies: float
    posterior_bits: float
    proven_bits: float
    mass: float = math.nan
    last_sure: float = math.nan


def score(comparison: Comparison, method: str, tolerance: Tolerance = WIDE, path: ReferencePath | None = None) -> Score:
    """Judge one method's answers to a drive; raises ``ScenarioError`` for a method that was not run.

    ``path`` is that of the comparison, where it is at hand.
    """
    if method not in comparison.beliefs:
        there = ", ".join(comparison.beliefs) or "none"
        raise ScenarioError(f"comparison {comparison.name!r} has no answers of {str(method)!r}; valid are {there}")
    path, held_by = path or path_of(comparison), comparison.held_by(method)
    outcomes, rows, left = [], [], None
    for view, belief in zip(comparison.query_views, comparison.beliefs[method], strict=True):
        truth = view.truth if path.known else None
        near = path.within(truth, tolerance)
        rank = _rank(belief, near)
        outcome = judge(truth, bool(near.any()), belief.lost > LOST_ABOVE, rank == 1)
        outcomes.append(outcome)
        left = truth if outcome in ON_MAP else left
        row = _row(path, truth, belief, near, rank, outcome, held_by)
        mass, last_sure = _mass(path, belief, tolerance), _last_sure(path, left, belief, outcome)
        rows.append(row._replace(mass=mass, last_sure=last_sure))
    scored = any(outcome is not Outcome.UNSCORED for outcome in outcomes)
    return Score(
        tolerance=tolerance,
        outcomes=tuple(outcomes),
        first_fixes=(first_fix(comparison.query_views, outcomes),) if scored else (),
        recovery=recovery_of(comparison.query_views, outcomes) if scored else Recovery((), ()),
        **_columns(rows),
    )


def _columns(rows: Sequence[_Row]) -> dict[str, NDArray[Any]]:
    kinds = _Row.__annotations__
    return {name: np.array([getattr(row, name) for row in rows], dtype=kinds[name]) for name in _Row._fields}


def _row(
    path: ReferencePath,
    truth: Pose | None,
    belief: Belief,
    near: NDArray[np.bool_],
    rank: float,
    outcome: Outcome,
    held_by: NDArray[np.intp],
) -> _Row:
    """Measure one answer; ``near`` (K,) are the right places, ``held_by`` (K,) who holds each place."""
    nearest = path.nearest_beside(belief.best, truth, near)
    error = places_off = false_fix = proven = math.nan
    if truth is not None and outcome in (Outcome.RIGHT, Outcome.WRONG):
        error = path.error(belief.best, truth, astray=nearest is None)
        places_off = math.inf if nearest is None else belief.best - nearest
    if truth is not None and outcome is Outcome.FALSE_FIX:
        false_fix = path.apart(belief.best, truth)
    if near.any() and (true_place := path.nearest(truth)) is not None:
        proven = proven_information([belief.places], [int(held_by[true_place])]).bits
    return _Row(
        errors=error,
        false_fixes=false_fix,
        lost=belief.lost,
        top=belief.places[belief.best],
        ranks=rank,
        places_off=places_off,
        entropies=belief.entropy,
        posterior_bits=posterior_information([belief.places]).bits,
        proven_bits=proven,
    )


def _mass(path: ReferencePath, belief: Belief, tolerance: Tolerance) -> float:
    """Probability of the places within the tolerance of the top one, itself among them."""
    around = path.within(path.pose(belief.best), tolerance).copy()
    around[belief.best] = True
    return min(float(belief.places[around].sum()), 1.0)


def _last_sure(path: ReferencePath, left: Pose | None, belief: Belief, outcome: Outcome) -> float:
    """Distance [m] between where a robot that is rightly lost was last sure and where it ``left`` the map."""
    if outcome is not Outcome.REJECTED or left is None or belief.last_sure is None:
        return math.nan
    return path.apart(belief.last_sure, left)


def _rank(belief: Belief, right: NDArray[np.bool_]) -> float:
    """Where the first right place stands when places go from most to least probable, from 1; infinite without any.

    Among places of the same probability the answer comes first, then those earlier on the path.
    """
    if not right.any():
        return math.inf
    order = np.argsort(-belief.places, kind="stable")
    order = np.concatenate([[belief.best], order[order != belief.best]])
    return float(np.argmax(right[order])) + 1


def pool(scores: Sequence[Score]) -> Score:
    """All views of several runs as one; raises ``ScenarioError`` for none, or for runs judged at other tolerances."""
    tolerances = {one.tolerance for one in scores}
    if len(tolerances) != 1:
        raise ScenarioError(f"{len(scores)} runs judged at {len(tolerances)} tolerances; valid is one tolerance")
    columns: dict[str, NDArray[Any]] = {
        name: np.concatenate([getattr(one, name) for one in scores]) for name in _Row._fields
    }
    return Score(
        tolerance=scores[0].tolerance,
        outcomes=tuple(chain.from_iterable(one.outcomes for one in scores)),
        first_fixes=tuple(chain.from_iterable(one.first_fixes for one in scores)),
        recovery=Recovery(*map(tuple, map(chain.from_iterable, zip(*(one.recovery for one in scores), strict=True)))),
        **columns,
    )


def harm(sequence: Score, single: Score) -> Proportion:
    """Count the views where the sequence answered wrong, among those that a single view had answered right."""
    pairs = list(zip(sequence.outcomes, single.outcomes, strict=True))
    return Proportion(pairs.count((Outcome.WRONG, Outcome.RIGHT)), single.outcomes.count(Outcome.RIGHT))
