"""The one scorer: what is right, what is wrong, and how sure that is.

A query view is *on the map* when some reference view lies within the tolerance of its true pose. The answer to a view
is ``belief.best``, unless ``belief.lost`` is above a threshold: then the localiser says that it is lost. An answer is
right when its reference pose lies within the tolerance of the true pose. A view without a true pose is not scored, only
counted; a reference view without one can be nobody's right answer.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq.planar import Pose
from refseq.view import View
from scenarios.errors import ScenarioError
from scenarios.scoring.comparison import Comparison
from scenarios.scoring.outcome import OFF_MAP, ON_MAP, Outcome
from scenarios.scoring.recovery import Episodes, Way, episodes, first_fix
from scenarios.scoring.reliability import Reliability, reliability

Z_95 = 1.959963984540054
"""Quantile of the normal distribution that leaves 2.5 % above it."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How near an answer must be: ``distance`` [m] and ``heading`` [rad], both inclusive."""

    distance: float = 1.5
    heading: float = math.radians(30)

    def __post_init__(self) -> None:
        if not (self.distance > 0 and self.heading > 0):
            raise ScenarioError(f"tolerance {self.distance} m, {self.heading} rad: valid are positive numbers")


WIDE = Tolerance()
"""The tolerance of the headline figures: 1.5 m and 30°."""

NARROW = Tolerance(0.5)
"""Printed beside it, always."""


RANKS = (1, 5, 10)
"""Numbers of most probable places for which recall is told."""

PLACES_OFF = (1, 2, 5)
"""Numbers of places by which an answer may be off, for which success by places is told."""


@dataclass(frozen=True, slots=True)
class Proportion:
    """``successes`` out of ``trials``."""

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share, ``nan`` without trials."""
        return self.successes / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % score interval (E. B. Wilson, JASA 22, 1927); (0, 1) without trials: nothing is known."""
        n, p, z = self.trials, self.value, Z_95
        if n == 0:
            return 0.0, 1.0
        centre = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        low = 0.0 if self.successes == 0 else centre - half
        high = 1.0 if self.successes == n else centre + half
        return low, high

    def __str__(self) -> str:
        return share_words(self.value, *self.interval)


def share_words(value: float, low: float, high: float) -> str:
    """A share in per cent with its interval; ``nan`` is one of nothing."""
    return "n/a" if math.isnan(value) else f"{100 * value:.1f} % [{100 * low:.0f}, {100 * high:.0f}]"


@dataclass(frozen=True)
class Retrieval:
    """Precision and recall over all distinct scores, from the surest answer on; ``recall`` rises.

    An answer's score is (1 − P(lost)) × the top place's probability. Precision counts right answers among those given,
    off the map too; recall counts them among all views on the map, so that it ends at the share of right top places.
    """

    thresholds: NDArray[np.float64]
    precision: NDArray[np.float64]
    recall: NDArray[np.float64]

    @property
    def auc(self) -> float:
        """Area under the steps of the curve (average precision)."""
        return float(np.sum(np.diff(self.recall, prepend=0.0) * self.precision))

    def recall_at(self, precision: float) -> float:
        """Largest recall that keeps at least this precision, 0 when none does."""
        enough = self.precision >= precision
        return float(self.recall[enough].max()) if enough.any() else 0.0


@dataclass(frozen=True)
class Score:
    """The views of one run or of several pooled ones, judged at one tolerance; arrays have one entry a view.

    ``errors`` [m] is the signed distance along the reference path from the true position to the answer, ``nan`` where
    no answer was due or given (lost, off the map, without truth). ``false_fixes`` [m] is how far from the true position
    the answer of a false fix lies, ``nan`` elsewhere. ``ranks`` is where the first right place stands among all places,
    the most probable being 1, lost or not, and infinite where no place is right; ``top_nearest`` says whether the top
    place is the very place nearest to the truth. ``places_off`` is by how many places an answer on the map is ahead of
    that one, ``nan`` as in ``errors``; ``entropies`` [nats] are those of the beliefs. ``first_fixes`` [m] holds for
    each run the distance travelled to its first right answer, ``None`` where there was none; ``episodes`` those of all
    runs.

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
    top_nearest: NDArray[np.bool_]
    places_off: NDArray[np.float64]
    entropies: NDArray[np.float64]
    first_fixes: tuple[Way, ...]
    episodes: Episodes

    def count(self, *outcomes: Outcome) -> int:
        """Count the views with one of these outcomes."""
        return sum(self.outcomes.count(outcome) for outcome in outcomes)

    @property
    def on_map(self) -> NDArray[np.bool_]:
        """Which views are on the map."""
        return np.isin(self.outcomes, ON_MAP)

    @property
    def off_map(self) -> NDArray[np.bool_]:
        """Which views have a true pose that no reference view is near to."""
        return np.isin(self.outcomes, OFF_MAP)

    @property
    def success(self) -> Proportion:
        """Right answers among all views on the map; a missed one counts against it."""
        return Proportion(self.count(Outcome.RIGHT), int(self.on_map.sum()))

    @property
    def failures(self) -> int:
        """Failures as the thesis counts them: wrong and missed."""
        return self.count(Outcome.WRONG, Outcome.MISSED)

    def error_quantile(self, share: float) -> float:
        """Quantile of the absolute along-path error over the answers given on the map [m], ``nan`` without any."""
        errors = np.abs(self.errors[np.isfinite(self.errors)])
        return float(np.quantile(errors, share)) if len(errors) else math.nan

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
        wrong, right = (np.array([one is kind for one in self.outcomes]) for kind in (Outcome.WRONG, Outcome.RIGHT))
        return auroc(self.entropies[wrong], self.entropies[right]) if len(self.outcomes) else None

    @property
    def worst_false_fix(self) -> float:
        """Farthest that an answer off the map lay from where the robot was [m], ``nan`` without any."""
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
    def top_reliability(self) -> Reliability:
        """The top place's probability over the views on the map, and how often it came true.

        The event that the probability should match is that the top place is the one nearest to the truth: a place a
        step farther on may be within the tolerance, but it is another place with a probability of its own.
        """
        return reliability(self.top[self.on_map], self.top_nearest[self.on_map])

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


def auroc(positives: NDArray[np.float64], negatives: NDArray[np.float64]) -> float | None:
    """Chance that a positive scores above a negative, ties counting half (Mann & Whitney); ``None`` without both."""
    if not (len(positives) and len(negatives)):
        return None
    ordered = np.sort(negatives)
    below = np.searchsorted(ordered, positives, side="left")
    not_above = np.searchsorted(ordered, positives, side="right")
    return float((below + not_above).sum() / (2 * len(positives) * len(negatives)))


def false_positive_rate(
    positives: NDArray[np.float64], negatives: NDArray[np.float64], true_positive_rate: float
) -> float | None:
    """Share of negatives at or above the highest threshold that enough positives reach; ``None`` without both."""
    if not (len(positives) and len(negatives)):
        return None
    needed = math.ceil(true_positive_rate * len(positives) - 1e-9)
    threshold = np.sort(positives)[len(positives) - needed]
    return float(np.mean(negatives >= threshold))


def retrieval(scores: NDArray[np.float64], right: NDArray[np.bool_], relevant: int) -> Retrieval:
    """Precision and recall when all answers with at least a score are taken, for every distinct score.

    ``scores`` and ``right`` are (n,); ``relevant`` is the number of views that have a right answer.
    """
    thresholds, taken = np.unique(-scores, return_counts=True)
    ends = np.cumsum(taken)
    hits = np.cumsum(right[np.argsort(-scores, kind="stable")])[ends - 1]
    return Retrieval(-thresholds, hits / ends, hits / relevant)


def score(comparison: Comparison, method: str, tolerance: Tolerance = WIDE, lost_above: float = LOST_ABOVE) -> Score:
    """Judge one method's answers to a drive; raises ``ScenarioError`` for a method that was not run."""
    if method not in comparison.beliefs:
        there = ", ".join(comparison.beliefs) or "none"
        raise ScenarioError(f"comparison {comparison.name!r} has no answers of {str(method)!r}; valid are {there}")
    beliefs = comparison.beliefs[method]
    path = path_of(comparison)
    truths = [view.truth for view in comparison.query_views]
    near = path.near(comparison.query_views, tolerance)
    on_map = [bool(places.any()) for places in near]
    ranks = np.array([_rank(belief, right) for belief, right in zip(beliefs, near, strict=True)], dtype=float)
    says_lost = np.array([belief.lost > lost_above for belief in beliefs], dtype=bool)
    nearest = [path.nearest_beside(b.best, truth, on) for b, truth, on in zip(beliefs, truths, near, strict=True)]
    held_by = comparison.held_by(method)
    outcomes = tuple(
        judge(truth, on, bool(lost), rank == 1)
        for truth, on, lost, rank in zip(truths, on_map, says_lost, ranks, strict=True)
    )
    return Score(
        tolerance=tolerance,
        outcomes=outcomes,
        errors=_errors(path, truths, beliefs, outcomes, nearest),
        false_fixes=_false_fixes(path, truths, beliefs, outcomes),
        lost=np.array([belief.lost for belief in beliefs], dtype=float),
        top=np.array([belief.places[belief.best] for belief in beliefs], dtype=float),
        ranks=ranks,
        top_nearest=np.array(
            [k is not None and held_by[k] == belief.best for k, belief in zip(nearest, beliefs, strict=True)],
            dtype=bool,
        ),
        places_off=_places_off(truths, nearest, beliefs, outcomes),
        entropies=np.array([belief.entropy for belief in beliefs], dtype=float),
        first_fixes=(first_fix(comparison.query_views, outcomes),),
        episodes=episodes(comparison.query_views, outcomes),
    )


def _rank(belief: Belief, right: NDArray[np.bool_]) -> float:
    """Where the first right place stands when places go from most to least probable, from 1; infinite without any.

    Among places of the same probability the answer comes first, then those earlier on the path.
    """
    if not right.any():
        return math.inf
    order = np.argsort(-belief.places, kind="stable")
    order = np.concatenate([[belief.best], order[order != belief.best]])
    return float(np.argmax(right[order])) + 1


def judge(truth: Pose | None, on_map: bool, says_lost: bool, right: bool) -> Outcome:
    """Decide the outcome of one view."""
    if truth is None:
        return Outcome.UNSCORED
    if not on_map:
        return Outcome.REJECTED if says_lost else Outcome.FALSE_FIX
    if says_lost:
        return Outcome.MISSED
    return Outcome.RIGHT if right else Outcome.WRONG


def _errors(
    path: "ReferencePath",
    truths: Sequence[Pose | None],
    beliefs: Sequence[Belief],
    outcomes: Sequence[Outcome],
    nearest: Sequence[int | None],
) -> NDArray[np.float64]:
    """Signed along-path error of each answer given on the map, (M,) [m]; ``nan`` elsewhere."""
    answered = (Outcome.RIGHT, Outcome.WRONG)
    return np.array(
        [
            path.error(belief.best, truth, astray=k is None) if truth is not None and outcome in answered else math.nan
            for truth, belief, outcome, k in zip(truths, beliefs, outcomes, nearest, strict=True)
        ],
        dtype=float,
    )


def _places_off(
    truths: Sequence[Pose | None],
    nearest: Sequence[int | None],
    beliefs: Sequence[Belief],
    outcomes: Sequence[Outcome],
) -> NDArray[np.float64]:
    """By how many places each answer given on the map is ahead of the one nearest to the truth, (M,)."""
    answered = (Outcome.RIGHT, Outcome.WRONG)
    return np.array(
        [
            (math.inf if k is None else belief.best - k) if truth is not None and outcome in answered else math.nan
            for truth, k, belief, outcome in zip(truths, nearest, beliefs, outcomes, strict=True)
        ],
        dtype=float,
    )


def _false_fixes(
    path: "ReferencePath", truths: Sequence[Pose | None], beliefs: Sequence[Belief], outcomes: Sequence[Outcome]
) -> NDArray[np.float64]:
    """How far each answer given off the map lies from the truth, (M,) [m]; ``nan`` elsewhere."""
    return np.array(
        [
            path.apart(belief.best, truth) if truth is not None and outcome is Outcome.FALSE_FIX else math.nan
            for truth, belief, outcome in zip(truths, beliefs, outcomes, strict=True)
        ],
        dtype=float,
    )


def pool(scores: Sequence[Score]) -> Score:
    """All views of several runs as one; raises ``ScenarioError`` for none, or for runs judged at other tolerances."""
    tolerances = {one.tolerance for one in scores}
    if len(tolerances) != 1:
        raise ScenarioError(f"{len(scores)} runs judged at {len(tolerances)} tolerances; valid is one tolerance")
    return Score(
        tolerance=scores[0].tolerance,
        outcomes=tuple(outcome for one in scores for outcome in one.outcomes),
        errors=np.concatenate([one.errors for one in scores]),
        false_fixes=np.concatenate([one.false_fixes for one in scores]),
        lost=np.concatenate([one.lost for one in scores]),
        top=np.concatenate([one.top for one in scores]),
        ranks=np.concatenate([one.ranks for one in scores]),
        top_nearest=np.concatenate([one.top_nearest for one in scores]),
        places_off=np.concatenate([one.places_off for one in scores]),
        entropies=np.concatenate([one.entropies for one in scores]),
        first_fixes=tuple(fix for one in scores for fix in one.first_fixes),
        episodes=Episodes(
            to_lost=tuple(way for one in scores for way in one.episodes.to_lost),
            to_recover=tuple(way for one in scores for way in one.episodes.to_recover),
        ),
    )


def harm(sequence: Score, single: Score) -> Proportion:
    """Count the views where the sequence answered wrong, among those that a single view had answered right."""
    pairs = list(zip(sequence.outcomes, single.outcomes, strict=True))
    return Proportion(pairs.count((Outcome.WRONG, Outcome.RIGHT)), single.outcomes.count(Outcome.RIGHT))


class ReferencePath:
    """The true poses of a reference drive as a path: ``size`` K places, ``along`` (K,) [m] from the first known pose.

    The path runs straight from each known pose to the next. A place without a pose has ``along`` nan and is near to
    nothing. Several drives are ``stretches`` of the views, each a path of its own; ``along`` goes on from one to the
    next without a gap.
    """

    def __init__(self, views: Sequence[View], stretches: Sequence[slice] | None = None) -> None:
        poses = [view.truth for view in views]
        if not any(poses):
            raise ScenarioError("the reference drive has no true pose; valid is a drive with one, to be scored against")
        table = [(pose.x, pose.y, pose.heading) if pose else (math.nan,) * 3 for pose in poses]
        self.size = len(table)
        self.points: NDArray[np.float64] = np.array(table)[:, :2]
        self.headings: NDArray[np.float64] = np.array(table)[:, 2]
        self._known = np.flatnonzero(np.isfinite(self.headings))
        self.stretches = tuple(stretches or (slice(0, self.size),))
        self._drive: NDArray[np.intp] = np.repeat(
            range(len(self.stretches)), [s.stop - s.start for s in self.stretches]
        )
        self._joined = np.diff(self._drive[self._known]) == 0
        steps = np.where(self._joined, np.linalg.norm(np.diff(self.points[self._known], axis=0), axis=1), 0.0)
        self.along: NDArray[np.float64] = np.full(self.size, math.nan)
        self.along[self._known] = np.concatenate([[0.0], np.cumsum(steps)])

    def within(self, pose: Pose | None, tolerance: Tolerance) -> NDArray[np.bool_]:
        """Which places lie within the tolerance of a pose, (K,); none when it is not known."""
        if pose is None:
            return np.zeros(self.size, dtype=bool)
        near = np.hypot(*(self.points - (pose.x, pose.y)).T) <= tolerance.distance
        return near & (angle_between(self.headings, pose.heading) <= tolerance.heading)

    def near(self, views: Sequence[View], tolerance: Tolerance) -> NDArray[np.bool_]:
        """Which places lie within the tolerance of each view's true pose, (M, K)."""
        return np.array([self.within(view.truth, tolerance) for view in views]).reshape(len(views), self.size)

    def apart(self, place: int, pose: Pose) -> float:
        """How far a place is from a pose, straight [m]; nan where it is not known."""
        return math.hypot(*(self.points[place] - (pose.x, pose.y)))

    def nearest(self, pose: Pose | None, among: slice | None = None) -> int | None:
        """Find the place nearest to a pose, among those that look the same way (within 90°), else among all.

        Only those of a stretch are looked at, if one is given.
        """
        if pose is None:
            return None
        distances = np.full(self.size, np.nan)
        distances[among or slice(None)] = np.hypot(*(self.points - (pose.x, pose.y)).T)[among or slice(None)]
        same_way = np.isfinite(distances) & (angle_between(self.headings, pose.heading) < math.pi / 2)
        candidates = np.where(same_way if same_way.any() else True, distances, np.nan)
        return None if np.isnan(candidates).all() else int(np.nanargmin(candidates))

    def pose(self, place: int) -> Pose | None:
        """The true pose of a place, None where it is not known."""
        x, y = self.points[place]
        return None if math.isnan(x) else Pose(float(x), float(y), float(self.headings[place]))

    def drive(self, place: int) -> int:
        """The number of the drive that a place is on."""
        return int(self._drive[place])

    def beside(self, place: int) -> slice:
        """The places of the drive that a place is on."""
        return self.stretches[self.drive(place)]

    def nearest_beside(self, place: int, pose: Pose | None, near: NDArray[np.bool_]) -> int | None:
        """Of the drive that a place is on the place nearest to a pose; None where none of it is among the ``near``.

        Where there is but one drive, it is simply the nearest.
        """
        own = self.beside(place)
        astray = len(self.stretches) > 1 and not near[own].any()
        return None if astray else self.nearest(pose, own)

    def error(self, place: int, pose: Pose, *, astray: bool) -> float:
        """From a pose to a place [m]: along the drive that the place is on, or straight, if that is ``astray``."""
        if astray:
            return self.apart(place, pose)
        return float(self.along[place] - self.project(pose, self.beside(place)))

    def project(self, pose: Pose, among: slice | None = None) -> float:
        """Distance along the path [m] of its point nearest to a pose, on stretches driven the same way if any.

        Only the places of a stretch are looked at, if one is given.
        """
        inside = self._joined.copy()
        if among is not None:
            inside &= (self._known[:-1] >= among.start) & (self._known[1:] < among.stop)
        starts, ends = self._known[:-1][inside], self._known[1:][inside]
        if not len(starts):
            return float(self.along[self.nearest(pose, among) or self._known[0]])
        leg = self.points[ends] - self.points[starts]
        length = np.linalg.norm(leg, axis=1)
        offset = np.array([pose.x, pose.y]) - self.points[starts]
        share = np.clip(np.einsum("ij,ij->i", offset, leg) / np.maximum(length, 1e-12) ** 2, 0, 1)
        miss = np.linalg.norm(offset - share[:, None] * leg, axis=1)
        same_way = angle_between(self.headings[starts], pose.heading) < math.pi / 2
        leg_number = int(np.argmin(np.where(same_way, miss, np.inf) if same_way.any() else miss))
        return float(self.along[starts[leg_number]] + share[leg_number] * length[leg_number])


def path_of(comparison: Comparison) -> ReferencePath:
    """The path, or the paths, of what was learnt. Raises ``ScenarioError`` where no pose is known."""
    return ReferencePath(comparison.reference_views, comparison.stretches)


def angle_between(headings: NDArray[np.float64], heading: float) -> NDArray[np.float64]:
    """Size of the turn between headings, (K,), in [0, π] [rad]."""
    turn = np.abs(headings - heading) % (2 * math.pi)
    return np.minimum(turn, 2 * math.pi - turn)
