"""The command ``refseq localise``: a later drive in a map, from its recording."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from refseq_bench.scenarios.cli.terminal.console import err, leave_below, out, print_json, print_results
from refseq_bench.scenarios.cli.terminal.options import (
    AtLeast,
    GroundTruthRule,
    Json,
    MapFile,
    NoisySelection,
    QueryFile,
    Seed,
    Sensors,
    Stages,
    TrajectoryName,
    WriteTrajectory,
    grouped,
)
from refseq_bench.scenarios.cli.terminal.outputs import BELIEFS
from refseq_bench.scenarios.drives.inputs import (
    check_output,
    load_map,
    read_drive,
    stages,
    words,
)
from refseq_bench.scenarios.drives.left_out import check_all_views
from refseq_bench.scenarios.errors import ScenarioError, about
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from refseq.fault import DeclaredFault
    from refseq.logs import Recording
    from refseq.map.map import Map
    from refseq_bench.scenarios.datasets.ground_truth import PictureTruth
    from refseq_bench.scenarios.drives.evaluate import StageResult
    from refseq_bench.scenarios.scoring.comparison import Comparison

TIMES = "times"
"""Key of a drive's metadata that folders of pictures have, to say where their times are from."""

LOCALISE_HELP = """Examples:

* `refseq localise map.refseq query.mcap -o beliefs.parquet`
* `refseq localise map.refseq query.mcap --stage chain --sensors camera-2 --at-least 80`
* `refseq localise map.refseq query.mcap -o run.parquet --trajectory tum && evo_ape tum run-truth.tum run-estimate.tum`

Places of a map of several paths are numbered through, in the order of the last table: of paths that hold 76 and 51
places, 0 to 75 are the first one's and 76 to 126 the second's."""


@grouped
def localise(
    map_file: MapFile,
    query: QueryFile,
    output: Annotated[Path | None, BELIEFS] = None,
    stage: Stages = None,
    sensors: Sensors = None,
    seed: Seed = 1,
    trajectory: WriteTrajectory = None,
    ground_truth: GroundTruthRule = None,
    at_least: AtLeast = None,
    as_json: Json = False,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """Localise a recorded drive in a map, view by view."""
    check_output(output, of=[map_file, query, *selection.chosen().files])
    wanted, chosen = stages(stage), words(sensors, "sensors")
    map_ = load_map(map_file)

    from refseq.map.matcher import check_among

    if trajectory is not None:
        _check_trajectories(map_, map_file, output, trajectory)
    with about(map_file):
        check_among(chosen or (), map_.sensors)
    drive = read_drive(query, selection.with_noise(seed + 1), chosen)
    name = f"{map_file.name} ← {query.name}"
    truth = None if ground_truth is None else _ground_truth(ground_truth, (map_, map_file), (drive, query), selection)
    if truth is None:
        check_scorable(map_, drive, at_least)
        if worlds := other_worlds(map_, drive):
            say(err, f"note: {worlds}: true poses of two worlds are compared, and right or wrong tell little")

    from refseq_bench.scenarios.drives.evaluate import compare

    with about(query, name):
        comparison = compare(name, map_, drive, stages=wanted, sensors=chosen, seed=seed)
    if output is not None and trajectory is not None:
        _write_trajectories(comparison, map_, output, trajectory, quiet=as_json)
    conclude(comparison, map_, output, at_least, as_json=as_json, truth=truth)


def other_worlds(map_: "Map", drive: "Recording") -> str:
    """Name the worlds of a map and of a drive in a clause, where both are told and the drive's is none of the map's.

    Empty where no true poses are compared.
    """
    from refseq_bench.scenarios.drives.evaluate import comparison_of
    from refseq_bench.scenarios.scoring.truth import unscored_reason

    learnt = [world for one in map_.sequences if (world := _world_of(one.metadata))]
    asked = _world_of(drive.metadata)
    if not asked or len(learnt) < len(map_.sequences) or asked in learnt:
        return ""
    if unscored_reason([comparison_of("", map_, drive, {})]):
        return ""
    return f"{asked} is the drive's world, and {', '.join(dict.fromkeys(learnt))} the map's"


def _world_of(metadata: "Mapping[str, object]") -> str:
    """The world that a drive was in; empty where a folder's name stands for it, as two of one place have two names."""
    return "" if TIMES in metadata else str(metadata.get("world", ""))


def _ground_truth(
    text: str, learnt: "tuple[Map, Path]", asked: "tuple[Recording, Path]", selection: NoisySelection
) -> "PictureTruth":
    """The ground truth by picture, seen to fit the map and the drive, each with its file, before the work begins."""
    from refseq_bench.scenarios.datasets.ground_truth import PictureTruth, ground_truth
    from refseq_bench.scenarios.drives.evaluate import comparison_of
    from refseq_bench.scenarios.drives.selection import first_kept

    (map_, map_file), (drive, query) = learnt, asked
    if selection.thin:
        raise ScenarioError(f"--thin {selection.thin:g} and --ground-truth exclude each other; valid is one of them")
    if not map_.has_one_path:
        raise ScenarioError(f"{map_file}: is a map of several paths; valid with --ground-truth is a map of one")
    check_all_views(map_.metadata, map_file)
    check_all_views(drive.metadata, query)
    found = PictureTruth(ground_truth(text), (0, first_kept(selection.views)))
    found.judging(comparison_of("", map_, drive, {}))
    return found


def _check_trajectories(map_: "Map", map_file: Path, output: Path | None, form: TrajectoryName) -> None:
    """Tell before the work begins what keeps trajectories from being written."""
    from refseq.logs.trajectories import TrajectoryFormat
    from refseq_bench.scenarios.drives.trajectories import ESTIMATE, ODOMETRY, TRUTH, check_frame, trajectory_path

    if output is None:
        raise ScenarioError(f"--trajectory {form}: its files are named after those of -o; valid is together with -o")
    check_frame(map_, map_file)
    check_output(*(trajectory_path(output, what, TrajectoryFormat(form)) for what in (ESTIMATE, ODOMETRY, TRUTH)))


def _write_trajectories(
    comparison: "Comparison", map_: "Map", output: Path, form: TrajectoryName, *, quiet: bool
) -> None:
    """Write the poses of the last stage, the odometry's and the true ones."""
    from refseq.logs.trajectories import TrajectoryFormat
    from refseq_bench.scenarios.drives.trajectories import write_trajectories

    last = list(comparison.beliefs.values())[-1]
    for file in write_trajectories(map_, comparison.query_views, last, output, TrajectoryFormat(form)):
        if not quiet:
            say(out, f"{file.path}: poses of {file.poses} of {plural(file.views, 'view')}")


def conclude(
    comparison: "Comparison",
    map_: "Map",
    output: Path | None,
    at_least: float | None,
    *,
    as_json: bool = False,
    truth: "PictureTruth | None" = None,
) -> None:
    """Write the beliefs, print how often they are right, and leave with 1 where that is less than asked [%].

    ``truth`` judges by picture, None: by true poses.
    """
    from refseq.fault import declared_in
    from refseq.logs.beliefs import write_beliefs
    from refseq_bench.scenarios.drives.evaluate import TOLERANCES, results

    if output is not None:
        metadata = {key: str(value) for key, value in comparison.query_metadata.items()}
        write_beliefs(output, comparison.query_views, comparison.beliefs, metadata)
    if truth is not None:
        comparison = truth.judging(comparison)
    found = results([comparison], truth.tolerances if truth else TOLERANCES)
    # Sensors are judged before the stages differ: all of them tell the same faults.
    faults = declared_in(belief.faults for belief in next(iter(comparison.beliefs.values())))
    if as_json:
        print_json(_summary(comparison, found, faults))
    else:
        if output is not None:
            say(out, f"{output}: beliefs of {plural(len(comparison.query_views), 'view')}")
        _tell(comparison, map_, found, faults)
    leave_below(found, at_least)


def _tell(
    comparison: "Comparison", map_: "Map", found: "Sequence[StageResult]", faults: "Sequence[DeclaredFault]"
) -> None:
    """Print how often the stages are right, what they tell beside places, and the faults that were declared."""
    from refseq_bench.scenarios.report.words import scale_words
    from refseq_bench.scenarios.scoring.pose_error import pose_errors
    from refseq_bench.scenarios.scoring.tables.sequence_recall import sequence_recall_table

    print_results(comparison.name, found, [comparison])
    for method, beliefs in comparison.beliefs.items():
        if errors := pose_errors(comparison, method):
            say(out, f"{method}: {errors}")
        if told := scale_words(beliefs):
            say(out, f"{method}: {told}")
    for fault in faults:
        say(out, f"fault: {fault}, at {fault.time:.1f} s")
    if not map_.has_one_path:
        out.print(sequence_recall_table(map_, comparison.beliefs))


def _summary(
    comparison: "Comparison", found: "Sequence[StageResult]", faults: "Sequence[DeclaredFault]"
) -> dict[str, object]:
    """All of it for JSON."""
    from refseq_bench.scenarios.scoring.truth import unscored_reason

    return {
        "name": comparison.name,
        "views": len(comparison.query_views),
        "unscored": unscored_reason([comparison]) or None,
        "faults": [asdict(fault) for fault in faults],
        "stages": [_record(one) | _scale(comparison, one.stage) | _poses(comparison, one.stage) for one in found],
    }


def _scale(comparison: "Comparison", method: str) -> dict[str, object]:
    """Metres of the map that a metre of the odometer was taken for in the end; nothing of a stage that never asks."""
    from refseq.belief import Stage

    return {"odometer_scale": round(comparison.beliefs[method][-1].odometer_scale, 4)} if method == Stage.CHAIN else {}


def _poses(comparison: "Comparison", method: str) -> dict[str, object]:
    """The errors of a stage's poses beside places; nothing where it tells none."""
    from refseq_bench.scenarios.scoring.pose_error import pose_errors

    errors = pose_errors(comparison, method)
    return {} if errors is None else {"pose_errors": errors.record}


def check_scorable(map_: "Map", drive: "Recording", at_least: float | None) -> None:
    """Refuse to ask for a share of right answers where nothing tells which are right, before any is given."""
    from refseq_bench.scenarios.drives.evaluate import comparison_of
    from refseq_bench.scenarios.scoring.truth import unscored_reason

    if at_least is not None and (unscored := unscored_reason([comparison_of("", map_, drive, {})])):
        raise ScenarioError(
            f"--at-least {at_least:g}: {unscored}, so that no answer can be called right; valid is a map and a drive "
            "with true poses, or no --at-least"
        )


def _record(one: "StageResult") -> dict[str, object]:
    """A stage's result, what needs no truth by the names that ``refseq compare --json`` has for it."""
    from refseq_bench.scenarios.scoring.figures import consistency_record

    return {
        "stage": one.stage,
        "success": [
            {"within": tolerance.distance, "unit": tolerance.unit, "right": share.successes, "of": share.trials}
            for tolerance, share in one.success.items()
        ],
        "failures": one.failures,
        "lost": one.lost,
        **consistency_record(one.consistency),
    }
