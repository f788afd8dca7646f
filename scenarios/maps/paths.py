"""The best paths of a drive through a map's chain, and how much of the path its views tell."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from refseq.inference.chain.chain import Observation, standing_once
from refseq.inference.chain.n_best import RankedPath, log_evidence, n_best_paths
from refseq.inference.chain.rescoring import DurationModel, rescored, second_order_term
from refseq.inference.chain.trajectory_entropy import trajectory_entropy
from refseq.map.guard import SensorGuard
from refseq.map.map import Map
from refseq.map.tracking.stages import ChainTracker
from refseq.map.tracking.stands import Stands
from refseq.view import View
from refseq_bench.scenarios.drives.evaluate import places_as_views
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, ReferencePath, Tolerance
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.tables import NONE, TextTable


@dataclass(frozen=True, slots=True)
class BestPaths:
    """The best paths of a drive, the first one best, with each one's share of the belief in all paths.

    ``right`` and ``right_narrow`` count the views on the map that a path has at a place within 1.5 m and 0.5 m of the
    truth; of none where no truth is known. The views tell ``told`` of ``unknown`` bits: so much is a path uncertain by
    the odometer alone.
    """

    paths: Sequence[RankedPath]
    shares: Sequence[float]
    right: Sequence[Proportion]
    right_narrow: Sequence[Proportion]
    told: float
    unknown: float


def best_paths(
    map_: Map, views: Sequence[View], most: int, *, durations: float = 0.0, second_order: float = 0.0, seed: int = 0
) -> BestPaths:
    """The ``most`` best paths of a whole drive; weights above 0 sort anew, by stays and by moves over two steps.

    Where the map's profile has ``stands_once``, views of a robot that stands count as one, and have its state.
    """
    tracker, guard, stands = ChainTracker(map_.sequence), SensorGuard(map_, seed=seed), Stands()
    observations, number = standing_once([tracker.observation(stands.mean(guard.match(view))[0]) for view in views])
    chain = tracker.chain
    found = n_best_paths(observations, chain, most)
    evidence = log_evidence(observations, chain)
    shares = {one.states: math.exp(min(0.0, one.log_score - evidence)) for one in found}
    terms = [DurationModel.of(chain).term(observations, durations)] if durations else []
    terms += [second_order_term(observations, chain, second_order)] if second_order else []
    found = rescored(found, *terms)
    unknown = trajectory_entropy([_blind(one) for one in observations], chain) / math.log(2)
    left = trajectory_entropy(observations, chain) / math.log(2)
    of_views = [replace(one, states=tuple(one.states[k] for k in number)) for one in found]
    truth = ReferencePath(places_as_views(map_))
    right, narrow = (_successes(of_views, truth, views, tolerance) for tolerance in (WIDE, NARROW))
    return BestPaths(of_views, [shares[one.states] for one in found], right, narrow, unknown - left, unknown)


def _successes(
    paths: Sequence[RankedPath], truth: ReferencePath, views: Sequence[View], tolerance: Tolerance
) -> list[Proportion]:
    """Views on the map that each path has at a right place, as ``Score.success`` counts them."""
    near = [truth.within(view.truth, tolerance) for view in views]
    due = sum(bool(right.any()) for right in near)
    counts = [
        sum(state < truth.size and bool(right[state]) for state, right in zip(one.states, near, strict=True))
        for one in paths
    ]
    return [Proportion(count, due) for count in counts]


def _blind(observation: Observation) -> Observation:
    """The same step, and nothing seen."""
    return Observation(observation.distance, np.zeros_like(observation.places), 0.0)


def paths_table(title: str, found: BestPaths, places: int) -> TextTable:
    """A row a path: how much less its score is than the best one's, its share, and its course."""
    table = TextTable(
        *("path", ">nats", ">share", ">right (0.5 m)", "places, by the views"),
        title=title,
        wraps=("places, by the views",),
    )
    columns = zip(found.paths, found.shares, found.right, found.right_narrow, strict=True)
    for number, (path, share, right, narrow) in enumerate(columns, start=1):
        less = path.log_score - found.paths[0].log_score
        told = f"{right.successes} ({narrow.successes}) of {right.trials}" if right.trials else NONE
        table.add_row(str(number), f"{less:.2f}", f"{100 * share:.3g} %", told, course(path.states, places))
    return table


def course(states: Sequence[int], places: int) -> str:
    """A path in words: places that rise by one a view as a range, others by themselves, Lost_Places by their number."""
    # Along a run of places the state less the view's number is the same, along one of a Lost_Place the state itself.
    runs = groupby(enumerate(states), key=lambda pair: (pair[1] >= places, pair[1] - pair[0] * (pair[1] < places)))
    return ", ".join(_run([state for _, state in run], places) for _, run in runs)


def _run(states: Sequence[int], places: int) -> str:
    first, last = states[0], states[-1]
    if first >= places:
        return f"lost {first - places}" + (f" × {len(states)}" if len(states) > 1 else "")
    return str(first) if first == last else f"{first}-{last}"
