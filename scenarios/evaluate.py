"""Localising a drive in a map and scoring the answers: what the commands and the demo share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.errors import MapError
from refseq.localiser import check_among, localise
from refseq.logs import Recording
from refseq.sequence import ReferenceSequence
from refseq.view import View
from scenarios.comparison import Comparison, shared_methods
from scenarios.score import NARROW, WIDE, Proportion, Tolerance, pool, score

TOLERANCES = (WIDE, NARROW)


def compare(
    name: str,
    sequence: ReferenceSequence,
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
    check_among(sensors or (), sequence.sensors)
    wanted = sensors or sequence.sensors
    if not query.sensors & frozenset(wanted):
        raise MapError(
            f"{name}: the drive's sensors ({', '.join(sorted(query.sensors)) or 'none'}) have none in common with the "
            f"map's; valid are {', '.join(sorted(wanted))}"
        )
    beliefs = localise(sequence, query.views, stages=stages, sensors=sensors, seed=seed)
    by_method: dict[str, Sequence[Belief]] = {stage: beliefs[stage] for stage in stages}
    return Comparison(
        name, reference or places_as_views(sequence), sequence.metadata, query.views, query.metadata, by_method
    )


def places_as_views(sequence: ReferenceSequence) -> tuple[View, ...]:
    """The map's places as views that have no sensor, only the true pose: all that scoring needs."""
    steps = [0.0, *(sequence.along[1:] - sequence.along[:-1])]
    return tuple(
        View(time=0.0, distance=float(step), truth=pose) for step, pose in zip(steps, sequence.poses, strict=True)
    )


@dataclass(frozen=True, slots=True)
class StageResult:
    """How one stage did, pooled over seeds: right answers of the views on the map, for each tolerance."""

    stage: Stage
    success: Mapping[Tolerance, Proportion]
    failures: int
    lost: int


def results(comparisons: Sequence[Comparison]) -> list[StageResult]:
    """Every stage's result over some comparisons of one experiment."""
    return [_result(comparisons, Stage(name)) for name in shared_methods(comparisons) if name in set(Stage)]


def _result(comparisons: Sequence[Comparison], stage: Stage) -> StageResult:
    pooled = {tolerance: pool([score(c, stage, tolerance) for c in comparisons]) for tolerance in TOLERANCES}
    lost = sum(belief.lost > LOST_ABOVE for comparison in comparisons for belief in comparison.beliefs[stage])
    success = {tolerance: total.success for tolerance, total in pooled.items()}
    return StageResult(stage, success, pooled[WIDE].failures, int(lost))
