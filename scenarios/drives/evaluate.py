"""Localising a drive in a map, and scoring the answers: what the commands and the demo share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.errors import MapError
from refseq.logs import Recording
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.map.matcher import check_among
from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives, shared_methods
from refseq_bench.scenarios.scoring.consistency.consistency import Consistency, consistency, pool_consistency
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, Tolerance
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.score import pool, score

TOLERANCES = (WIDE, NARROW)


def compare(
    name: str,
    map_: Map,
    query: Recording,
    *,
    reference: Sequence[View] | None = None,
    stages: Sequence[Stage] = tuple(Stage),
    sensors: Sequence[str] | None = None,
    seed: int = 0,
) -> Comparison:
    """Localise every view of ``query``. ``reference`` are the map's views with images, where they are at hand.

    Raises ``MapError`` for a sensor that the map does not have, and when the drive has none of those that are wanted.
    """
    check_among(sensors or (), map_.sensors)
    wanted = sensors or map_.sensors
    if not query.sensors & frozenset(wanted):
        raise MapError(
            f"{name}: the drive's sensors ({', '.join(sorted(query.sensors)) or 'none'}) have none in common with the "
            f"map's; valid are {', '.join(sorted(wanted))}, or the drive's by those names (--topics NAME=TOPIC)"
        )
    beliefs = localise(map_, query.views, stages=stages, sensors=sensors, seed=seed)
    return comparison_of(name, map_, query, {stage: beliefs[stage] for stage in stages}, reference)


def comparison_of(
    name: str,
    map_: Map,
    query: Recording,
    beliefs: Mapping[str, Sequence[Belief]],
    reference: Sequence[View] | None = None,
) -> Comparison:
    """Put together answers about the places of a map: those of all its sequences, one behind the other.

    Its drives are the sequences, each as long as the places that it still holds. ``reference`` are the places' views
    with images, where they are at hand. Raises ``ScenarioError`` for answers that do not fit map or query.
    """
    drives = Drives(map_.names, tuple(map(len, map_.sequences)))
    views = reference or places_as_views(map_)
    return Comparison(name, views, map_.metadata, query.views, query.metadata, beliefs, drives)


def places_as_views(map_: Map) -> tuple[View, ...]:
    """The map's places as views that have no sensor, only the true pose: all that scoring needs."""
    steps = np.concatenate([np.diff(sequence.along, prepend=sequence.along[0]) for sequence in map_.sequences])
    return tuple(View(time=0.0, distance=float(step), truth=pose) for step, pose in zip(steps, map_.poses, strict=True))


@dataclass(frozen=True, slots=True)
class StageResult:
    """Result of one stage, pooled over seeds: right answers of the views on the map, for each tolerance.

    ``failures`` are None where no view could be judged, for want of true poses; ``consistency`` needs none.
    """

    stage: Stage
    success: Mapping[Tolerance, Proportion]
    failures: int | None
    lost: int
    consistency: Consistency


def results(
    comparisons: Sequence[Comparison], tolerances: tuple[Tolerance, Tolerance] = TOLERANCES
) -> list[StageResult]:
    """Every stage's result over some comparisons of one experiment, within two tolerances, the wider first."""
    stages = [Stage(name) for name in shared_methods(comparisons) if name in set(Stage)]
    return [_result(comparisons, stage, tolerances) for stage in stages]


def _result(comparisons: Sequence[Comparison], stage: Stage, tolerances: tuple[Tolerance, Tolerance]) -> StageResult:
    pooled = {tolerance: pool([score(c, stage, tolerance) for c in comparisons]) for tolerance in tolerances}
    lost = sum(belief.lost > LOST_ABOVE for comparison in comparisons for belief in comparison.beliefs[stage])
    success = {tolerance: total.success for tolerance, total in pooled.items()}
    wide = pooled[tolerances[0]]
    failures = wide.failures if wide.scored else None
    found = pool_consistency([consistency(one, stage, tolerances[0]) for one in comparisons])
    return StageResult(stage, success, failures, int(lost), found)
