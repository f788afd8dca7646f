"""Scores of maps of several drives: joins against the truth, and what comes of them where paths part.

A view of one drive is *shared* with another that has a view within half the tolerance of it: that drive passes its
place. A view that was taken out is rightly joined where the view that holds its place now lies within the tolerance.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.belief import LOST_ABOVE, Belief
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.consistency.answers import query_travelled
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance, path_of
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.recovery import DistanceOrNever, true_way
from refseq_bench.scenarios.scoring.truth import missing_truth

SETTLED = 0.9
"""P(right) above which a fork is decided."""


@dataclass(frozen=True, slots=True)
class JoinScore:
    """Joins of a map against the truth.

    ``precision``: of the views taken out those that are rightly joined. ``recall``: of all views shared with another
    drive, counted once for each, those whose place is held by the sequence that holds that drive's there.
    ``duplicates`` are places that a place of another sequence lies within half the tolerance of. ``joins`` are all
    joins made, ``false_joins`` those of which most pairs of views are farther apart than the tolerance, ``overlooked``
    refused ones of which most are not. ``places`` are left of ``views``, ``bytes_after`` of ``bytes_before``;
    ``seconds`` is what merging took. Without true poses nobody knows of ``duplicates``, ``false_joins`` and
    ``overlooked`` ones: they are None, and the shares are of nothing.
    """

    precision: Proportion
    recall: Proportion
    duplicates: int | None
    joins: int
    false_joins: int | None
    overlooked: int | None
    places: int
    views: int
    bytes_before: int
    bytes_after: int
    seconds: float


class SequenceShares(NamedTuple):
    """P(s) of the drive that the robot is on and stays on, view by view: what (4.5) to (4.8) are to tell.

    ``before`` it comes to the first stretch that several drives pass, ``on`` such stretches, and ``behind`` them. Where
    maps are merged, all of a stretch's belief is at the drive that holds its places, whichever is driven.
    """

    before: tuple[float, ...] = ()
    on: tuple[float, ...] = ()
    behind: tuple[float, ...] = ()


NO_SHARES = SequenceShares()


@dataclass(frozen=True, slots=True)
class AtlasScore:
    """Score of a method that has learnt several drives.

    ``forks`` hold, each time the robot comes off one of several drives and stays on another, the way [m] until
    P(right), the probability of all places within the tolerance, is above ``SETTLED``, along the true path; None where
    that never came, as long as it stayed on the map. ``jumps`` are answers farther from the last one than the robot can
    have come by its odometer, by more than twice the tolerance, both of them given on the map, None without truth, or
    without odometry. ``joined`` is None of a method without
    an atlas. ``shares`` are P(s) before, on and behind what drives share.
    """

    forks: tuple[DistanceOrNever, ...]
    jumps: int | None
    joined: JoinScore | None
    shares: SequenceShares = NO_SHARES


def atlas_score(comparison: Comparison, method: str, tolerance: Tolerance) -> AtlasScore:
    """Judge one method's answers to a drive, where several were learnt."""
    path = path_of(comparison)
    near = path.near(comparison.query_views, tolerance)
    beliefs = comparison.beliefs[method]
    merging = comparison.mergings.get(method)
    return AtlasScore(
        forks=tuple(_forks(comparison, path, near, p_right(beliefs, near))),
        jumps=_jumps(comparison, path, beliefs, near, tolerance),
        joined=None if merging is None else join_score(path, merging, tolerance),
        shares=_sequence_shares(path, near, beliefs),
    )


def p_right(beliefs: Sequence[Belief], near: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Probability that is given to places near the truth, (M,); ``near`` (M, K) says which these are."""
    return np.array([(1 - b.lost) * float(b.places[right].sum()) for b, right in zip(beliefs, near, strict=True)])


def passing(path: ReferencePath, near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark the drives that pass each query view, (M, D)."""
    return np.stack([near[:, stretch].any(axis=1) for stretch in path.stretches], axis=1)


def _forks(
    comparison: Comparison, path: ReferencePath, near: NDArray[np.bool_], right: NDArray[np.float64]
) -> list[DistanceOrNever]:
    by = passing(path, near)
    # A drive is left where it passed the last view and passes none of the next few: its views are not that even.
    forks = [
        t for t in range(1, len(by)) if (by[t - 1] & ~by[t : t + 3].any(axis=0)).any() and (by[t - 1] & by[t]).any()
    ]
    travelled = {one.view: one.travelled for one in true_way(comparison.query_views)}
    found: list[DistanceOrNever] = []
    for t in forks:
        gone = np.flatnonzero(~by[t:].any(axis=1))
        end = t + int(gone[0]) if len(gone) else len(by)
        settled = np.flatnonzero(right[t:end] > SETTLED)
        found.append(travelled[t + int(settled[0])] - travelled[t] if len(settled) else None)
    return found


def _sequence_shares(path: ReferencePath, near: NDArray[np.bool_], beliefs: Sequence[Belief]) -> SequenceShares:
    by = passing(path, near)
    shared, alone = by.sum(axis=1) > 1, by.sum(axis=1) == 1
    met = np.logical_or.accumulate(shared)
    found: tuple[list[float], list[float], list[float]] = ([], [], [])
    for t, belief in enumerate(beliefs):
        later = np.flatnonzero(alone[t:])
        if not len(later) or not (by[t] & by[t + later[0]]).any():
            continue  # off all drives, or nobody knows which of them it stays on
        drive = int(np.argmax(by[t + later[0]]))
        found[1 if shared[t] else 2 * int(met[t])].append(float(belief.places[path.stretches[drive]].sum()))
    return SequenceShares(*map(tuple, found))


def _jumps(
    comparison: Comparison,
    path: ReferencePath,
    beliefs: Sequence[Belief],
    near: NDArray[np.bool_],
    tolerance: Tolerance,
) -> int | None:
    """Answers that no drive can have led to from the answer before; None where no odometry was measured."""
    travelled = query_travelled(comparison)
    if missing_truth(comparison) or np.isnan(travelled).any():
        return None
    given = [t for t, belief in enumerate(beliefs) if belief.lost <= LOST_ABOVE and near[t].any()]
    steps = [
        math.dist(path.points[beliefs[t].best], path.points[beliefs[last].best]) - (travelled[t] - travelled[last])
        for last, t in pairwise(given)
    ]
    return sum(bool(step > 2 * tolerance.distance) for step in steps)


def join_score(path: ReferencePath, merging: Merging, tolerance: Tolerance) -> JoinScore:
    """Judge what was merged by the true poses of the views."""
    if not path.known:
        return _unjudged(path, merging)
    half = Tolerance(tolerance.distance / 2, tolerance.heading)
    taken = np.flatnonzero(merging.held_by != np.arange(path.size)).tolist()
    right = [bool(path.within(path.pose(view), tolerance)[merging.held_by[view]]) for view in taken]
    judged = [(decision, _is_true(decision, path, merging, tolerance)) for decision in merging.decisions]
    return JoinScore(
        precision=Proportion(sum(right), len(right)),
        recall=_recall(path, merging, half),
        duplicates=_duplicates(path, merging, half),
        joins=sum(decision.joined for decision, _ in judged),
        false_joins=sum(decision.joined and not true for decision, true in judged),
        overlooked=sum(true and not decision.joined for decision, true in judged),
        places=len(set(merging.held_by.tolist())),
        views=path.size,
        bytes_before=merging.size[0],
        bytes_after=merging.size[1],
        seconds=merging.seconds,
    )


def _unjudged(path: ReferencePath, merging: Merging) -> JoinScore:
    """Count what was merged where no pose is known."""
    return JoinScore(
        precision=Proportion(0, 0),
        recall=Proportion(0, 0),
        duplicates=None,
        joins=sum(decision.joined for decision in merging.decisions),
        false_joins=None,
        overlooked=None,
        places=len(set(merging.held_by.tolist())),
        views=path.size,
        bytes_before=merging.size[0],
        bytes_after=merging.size[1],
        seconds=merging.seconds,
    )


def _recall(path: ReferencePath, merging: Merging, half: Tolerance) -> Proportion:
    """Of all views and other drives that pass them, those that share the sequence which holds the place."""
    holder = np.array([path.drive(view) for view in merging.held_by])
    joined, shared = 0, 0
    for view in range(path.size):
        near = path.within(path.pose(view), half)
        for drive, stretch in enumerate(path.stretches):
            if drive != path.drive(view) and near[stretch].any():
                shared += 1
                joined += bool((holder[stretch][near[stretch]] == holder[view]).any())
    return Proportion(joined, shared)


def _duplicates(path: ReferencePath, merging: Merging, half: Tolerance) -> int:
    """Places that lie beside one of another sequence."""
    places = np.unique(merging.held_by)
    drives = np.array([path.drive(place) for place in places])
    near = (path.within(path.pose(int(place)), half)[places] & (drives != path.drive(place)) for place in places)
    return sum(bool(one.any()) for one in near)


def _is_true(decision: Decision, path: ReferencePath, merging: Merging, tolerance: Tolerance) -> bool:
    """Tell whether most views of the second stretch lie beside one of the first."""
    one, other = (path.stretches[merging.names.index(name)].start for name in (decision.one, decision.other))
    first = slice(one + decision.first[0], one + decision.first[1] + 1)
    views = range(other + decision.second[0], other + decision.second[1] + 1)
    beside = [bool(path.within(path.pose(view), tolerance)[first].any()) for view in views]
    return sum(beside) > len(beside) / 2


def pool_atlas(scores: Sequence[AtlasScore]) -> AtlasScore:
    """Several runs as one: counts and bytes are added up."""
    joined = [score.joined for score in scores if score.joined is not None]
    return AtlasScore(
        forks=tuple(way for score in scores for way in score.forks),
        jumps=_total([score.jumps for score in scores]),
        joined=_pool_joins(joined) if joined else None,
        shares=SequenceShares(
            *(tuple(chain.from_iterable(part)) for part in zip(*(s.shares for s in scores), strict=True))
        ),
    )


def _pool_joins(scores: Sequence[JoinScore]) -> JoinScore:
    return JoinScore(
        precision=Proportion.pooled([one.precision for one in scores]),
        recall=Proportion.pooled([one.recall for one in scores]),
        **{field.name: _total([getattr(one, field.name) for one in scores]) for field in fields(JoinScore)[2:]},
    )


def _total(counts: Sequence[Any]) -> Any:
    """The sum, None where one of them is not known."""
    return None if None in counts else sum(counts)
