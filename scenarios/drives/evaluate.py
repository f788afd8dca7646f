"""Localising a drive in a map, or in an atlas, and scoring the answers: what the commands and the demo share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from refseq.atlas.atlas import Atlas
from refseq.atlas.localiser import localise_in
from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.errors import MapError
from refseq.logs import Recording
from refseq.map.localiser import check_among, localise
from refseq.map.sequence import ReferenceSequence
from refseq.view import View
from scenarios.scoring.comparison import Comparison, Drives, shared_methods
from scenarios.scoring.path_geometry import NARROW, WIDE, Tolerance
from scenarios.scoring.proportion import Proportion
from scenarios.scoring.score import pool, score

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
    _check_sensors(name, sequence, query, sensors)
    beliefs = localise(sequence, query.views, stages=stages, sensors=sensors, seed=seed)
    by_method: dict[str, Sequence[Belief]] = {stage: beliefs[stage] for stage in stages}
    return Comparison(
        name, reference or places_as_views(sequence), sequence.metadata, query.views, query.metadata, by_method
    )


def compare_in_atlas(
    name: str,
    atlas: Atlas,
    query: Recording,
    *,
    stages: Sequence[Stage] = tuple(Stage),
    sensors: Sequence[str] | None = None,
    seed: int = 0,
) -> Comparison:
    """Localise every view of ``query`` in an atlas; one of a single map answers as ``compare`` does, bit for bit.

    Raises ``MapError`` as ``compare`` does.
    """
    if is_one_map(atlas):
        return compare(name, atlas.sequences[0], query, stages=stages, sensors=sensors, seed=seed)
    _check_sensors(name, atlas.sequences[0], query, sensors)  # all have the same, or they would make no atlas
    beliefs = localise_in(atlas, query.views, stages=stages, sensors=sensors, seed=seed)
    return answers_in_atlas(name, atlas, query, {stage: beliefs[stage] for stage in stages})


def answers_in_atlas(
    name: str,
    atlas: Atlas,
    query: Recording,
    beliefs: Mapping[str, Sequence[Belief]],
    reference: Sequence[View] | None = None,
) -> Comparison:
    """Put together answers about the places of an atlas: those of all sequences, one behind the other.

    Its drives are the sequences, each as long as the places that it still holds. ``reference`` are the places' views
    with images, where they are at hand. Raises ``ScenarioError`` for answers that do not fit atlas or query.
    """
    drives = None if is_one_map(atlas) else Drives(atlas.names, tuple(map(len, atlas.sequences)))
    views = reference or [view for sequence in atlas.sequences for view in places_as_views(sequence)]
    return Comparison(name, views, _metadata(atlas), query.views, query.metadata, beliefs, drives)


def is_one_map(atlas: Atlas) -> bool:
    """Whether it is what a map alone would be read as: one sequence, and the path that it was learnt from."""
    return len(atlas.sequences) == len(atlas.paths) == 1


def _metadata(atlas: Atlas) -> Mapping[str, str]:
    """What is known of the drives, by key; where they differ, what each says, commas between."""
    if is_one_map(atlas):
        return atlas.sequences[0].metadata
    values: dict[str, dict[str, None]] = {}
    for sequence in atlas.sequences:
        for key, value in sequence.metadata.items():
            values.setdefault(key, {})[str(value)] = None
    return {key: ", ".join(all_) for key, all_ in values.items()}


def _check_sensors(name: str, sequence: ReferenceSequence, query: Recording, sensors: Sequence[str] | None) -> None:
    check_among(sensors or (), sequence.sensors)
    wanted = sensors or sequence.sensors
    if not query.sensors & frozenset(wanted):
        raise MapError(
            f"{name}: the drive's sensors ({', '.join(sorted(query.sensors)) or 'none'}) have none in common with the "
            f"map's; valid are {', '.join(sorted(wanted))}"
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
