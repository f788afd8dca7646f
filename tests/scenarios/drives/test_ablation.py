import csv
import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.errors import MapError
from refseq.features import Observed
from refseq.logs import Recording
from refseq.map.localiser import localise
from refseq.map.sequence import ReferenceSequence, learn
from refseq.view import View
from scenarios.drives import ablation as module
from scenarios.drives.ablation import (
    Ablation,
    Case,
    Experiment,
    Remembering,
    ablation_table,
    answer,
    cases_of,
    check_table,
    left_out,
    pairs_of,
    run_ablation,
    write_table,
)
from scenarios.drives.evaluate import compare, results
from scenarios.errors import ScenarioError
from tests.scenarios.maps.test_matrix import printed
from tests.support import corridor_drive

ROBOT = ("camera-1", "camera-2", "laser")
FEATURES = ("sift", "walls", "boundary")


def drive(seed: int, light: str, count: int = 14) -> Recording:
    views = corridor_drive(np.random.default_rng(seed), count=count, size=96)
    named = [replace(v, images=dict(zip(ROBOT, v.images.values(), strict=False))) for v in views]
    return Recording(tuple(named), {"world": "corridor", "light": light, "seed": str(seed)})


def without(recording: Recording, *sensors: str) -> Recording:
    views = [
        replace(
            view,
            images={name: image for name, image in view.images.items() if name not in sensors},
            scan=None if "laser" in sensors else view.scan,
        )
        for view in recording.views
    ]
    return replace(recording, views=tuple(views))


@pytest.fixture(scope="module")
def recorded() -> dict[str, Recording]:
    return {"r1": drive(1, "16:00"), "q1": drive(2, "18:00"), "r2": drive(3, "16:00"), "q2": drive(4, "18:00", 11)}


@pytest.fixture
def drives(recorded: dict[str, Recording]) -> dict[str, Recording]:
    """A test may put other drives in their place."""
    return dict(recorded)


@pytest.fixture(scope="module")
def sequence(recorded: dict[str, Recording]) -> ReferenceSequence:
    return learn(recorded["r1"].views, features=FEATURES, metadata=recorded["r1"].metadata)


@pytest.fixture
def files(drives: dict[str, Recording], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Names of files that reading answers with these drives."""
    paths = {name: tmp_path / f"{name}.mcap" for name in drives}
    for path in paths.values():
        path.touch()
    monkeypatch.setattr(module, "read_drive", lambda path, *_: drives[path.stem])
    return paths


# --- rows ---


def test_rows_are_those_of_the_figure() -> None:
    assert [(case.name, case.stage) for case in cases_of(ROBOT)] == [
        ("camera-1", Stage.UNIFORM),
        ("camera-1 + laser", Stage.UNIFORM),
        ("camera-2 + laser", Stage.UNIFORM),
        ("camera-1 + camera-2", Stage.UNIFORM),
        ("all", Stage.UNIFORM),
        ("all", Stage.PRIOR),
        ("all", Stage.CHAIN),
    ]
    assert left_out(ROBOT) == ""


@pytest.mark.parametrize(
    ("sensors", "names", "line"),
    [
        (("laser",), ["laser"] * 3, "no camera-1, camera-2 in both drives: left out camera-1, camera-1 + laser, "),
        (("camera-1", "laser"), ["camera-1", *["all"] * 3], "no camera-2 in both drives: left out camera-2 + laser, "),
        (("camera-1", "camera-2"), ["camera-1", *["all"] * 3], "no laser in both drives: left out camera-1 + laser, "),
        (("left", "right"), ["all"] * 3, "no camera-1, camera-2, laser in both drives: left out camera-1, camera-1 + "),
    ],
)
def test_a_robot_that_lacks_sensors_has_fewer_rows_and_is_told_which(
    sensors: Sequence[str], names: list[str], line: str
) -> None:
    assert [case.name for case in cases_of(sensors)] == names
    assert left_out(sensors).startswith(line)


def test_every_subset_is_asked_once_at_each_stage() -> None:
    found = Counter((frozenset(case.sensors), case.stage) for case in cases_of(ROBOT, every=True))
    assert len(found) == (2**3 - 1) * len(Stage)
    assert set(found.values()) == {1}


# --- answers ---


def test_answers_are_those_of_asking_the_map_with_these_sensors(
    sequence: ReferenceSequence, drives: dict[str, Recording]
) -> None:
    cases = cases_of(ROBOT, every=True)
    found = answer(sequence, drives["q1"], cases, seed=3)
    assert list(found) == list(cases)
    for case in cases:
        beliefs = localise(sequence, drives["q1"].views, stages=(case.stage,), sensors=case.sensors, seed=3)
        for one, other in zip(found[case].beliefs[case.stage], beliefs[case.stage], strict=True):
            np.testing.assert_array_equal(one.places, other.places)
            assert (one.lost, one.path) == (other.lost, other.path)
        assert not any(view.sensors for view in found[case].query_views), "pictures are not kept"


def test_each_view_is_looked_at_once_by_each_extractor(
    sequence: ReferenceSequence, drives: dict[str, Recording]
) -> None:
    asked: Counter[tuple[str, int]] = Counter()

    class Counting(Remembering):
        def observe(self, view: View) -> Observed:
            asked[self.key, id(view)] += 1
            return self._extractor.observe(view)

    watched = replace(sequence, extractors=tuple(Counting(e) for e in sequence.extractors))
    answer(watched, drives["q1"], cases_of(ROBOT, every=True), seed=0)
    assert len(asked) == len(sequence.extractors) * len(drives["q1"].views)
    assert set(asked.values()) == {1}


def test_what_is_remembered_is_of_the_view_itself(sequence: ReferenceSequence, drives: dict[str, Recording]) -> None:
    extractor = sequence.extractors[0]
    remembering = Remembering(extractor)
    assert (remembering.key, remembering.sensor, remembering.size) == (extractor.key, extractor.sensor, extractor.size)
    assert set(remembering.state()) == set(extractor.state())
    for _ in range(2):
        for view in drives["q1"].views:
            copy = replace(view)  # a new object each time, freed at once unless it is kept
            np.testing.assert_array_equal(remembering.observe(copy).ids, extractor.observe(view).ids)
    with pytest.raises(TypeError, match=r"^sift/camera-1 only observes$"):
        remembering.learn(drives["q1"].views[0])


# --- tables ---


def test_pairs_of_the_same_lights_are_pooled(files: dict[str, Path], drives: dict[str, Recording]) -> None:
    steps: list[str] = []
    pairs = pairs_of([files["r1"], files["q1"], files["r2"], files["q2"]])
    found, sensors = run_ablation(Ablation(pairs, features=FEATURES, seed=5), steps.append)
    assert sensors == ROBOT
    assert steps == ["learn 1 of 2", "localise 1 of 2", "learn 2 of 2", "localise 2 of 2"]
    (experiment,) = found
    assert (experiment.name, experiment.views) == ("corridor, 16:00 → 18:00", 25)
    assert experiment.pairs == tuple((str(first), str(later)) for first, later in pairs)
    for row in experiment.rows:
        runs = [
            compare(
                "x",
                learn(drives[first].views, features=FEATURES),
                drives[later],
                sensors=row.case.sensors,
                stages=(row.case.stage,),
                seed=5,
            )
            for first, later in (("r1", "q1"), ("r2", "q2"))
        ]
        assert row.result == results(runs)[0]
        posteriors = [belief.places for run in runs for belief in run.beliefs[row.case.stage]]
        entropies = [-np.sum(p[p > 0] * np.log2(p[p > 0])) for p in posteriors]
        assert row.told.bits == pytest.approx(math.log2(14) - np.mean(entropies), abs=1e-9)
        assert row.proven is not None
        nearest = [
            p[np.argmin([abs(place.truth.x - view.truth.x) for place in run.reference_views])]  # type: ignore[union-attr]
            for run in runs
            for view, p in zip(run.query_views, (b.places for b in run.beliefs[row.case.stage]), strict=True)
        ]
        assert row.proven.bits == pytest.approx(math.log2(14) + np.mean(np.log2(nearest)), abs=1e-9)


def test_one_reference_is_learnt_once_and_other_lights_get_their_own_table(
    files: dict[str, Path], drives: dict[str, Recording]
) -> None:
    drives["late"] = replace(drives["q2"], metadata={**drives["q2"].metadata, "light": "late-evening"})
    late = files["q1"].with_name("late.mcap")
    late.touch()
    steps: list[str] = []
    pairs = pairs_of([files["r1"], files["q1"], files["r1"], late])
    found, _ = run_ablation(Ablation(pairs, features=("boundary",)), steps.append)
    assert steps == ["learn 1 of 2", "localise 1 of 2", "localise 2 of 2"]
    assert [one.name for one in found] == ["corridor, 16:00 → 18:00", "corridor, 16:00 → late-evening"]
    assert [len(one.pairs) for one in found] == [1, 1]


def test_a_file_that_is_not_there_is_told_before_any_is_read(
    files: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "read_drive", lambda *_: pytest.fail("a drive was read"))
    pairs = pairs_of([files["r1"], files["q1"], files["r2"], Path("gone.mcap")])
    with pytest.raises(ScenarioError, match=r"^gone\.mcap: is no file; valid is a recording$"):
        run_ablation(Ablation(pairs), lambda _: None)


def test_drives_without_a_common_sensor_are_told(files: dict[str, Path], drives: dict[str, Recording]) -> None:
    drives["q1"], drives["r1"] = without(drives["q1"], "laser"), without(drives["r1"], "camera-1", "camera-2")
    with pytest.raises(
        ScenarioError,
        match=r"q1\.mcap: its sensors \(camera-1, camera-2\) have none in common with those of \S+; valid are laser$",
    ):
        run_ablation(Ablation(pairs_of([files["r1"], files["q1"]]), features=("walls",)), lambda _: None)


def test_pairs_of_other_sensors_are_told(files: dict[str, Path], drives: dict[str, Recording]) -> None:
    drives["q2"] = without(drives["q2"], "camera-2")
    pairs = pairs_of([files["r1"], files["q1"], files["r2"], files["q2"]])
    with pytest.raises(ScenarioError, match=r"q2\.mcap: share camera-1, laser; valid is what the first pair does, cam"):
        run_ablation(Ablation(pairs, features=FEATURES), lambda _: None)


def test_a_query_without_one_of_the_sensors_is_asked_by_the_others(
    files: dict[str, Path], drives: dict[str, Recording]
) -> None:
    drives["q1"] = without(drives["q1"], "camera-2")
    found, sensors = run_ablation(Ablation(pairs_of([files["r1"], files["q1"]]), features=FEATURES), lambda _: None)
    assert sensors == ("camera-1", "laser")
    assert [row.case.name for row in found[0].rows] == ["camera-1", "all", "all", "all"]


def test_features_without_a_sensor_are_told(files: dict[str, Path]) -> None:
    with pytest.raises(MapError, match=r"^feature 'magic' is unknown"):
        run_ablation(Ablation(pairs_of([files["r1"], files["q1"]]), features=("magic",)), lambda _: None)


def test_a_drive_without_truth_is_no_ablation(files: dict[str, Path], drives: dict[str, Recording]) -> None:
    drives["r1"] = replace(drives["r1"], views=tuple(replace(view, truth=None) for view in drives["r1"].views))
    with pytest.raises(ScenarioError, match=r"^the reference drive has no true pose"):
        run_ablation(Ablation(pairs_of([files["r1"], files["q1"]]), features=("boundary",)), lambda _: None)


# --- what is written ---


@pytest.fixture
def found(files: dict[str, Path]) -> tuple[list[Experiment], Ablation]:
    asked = Ablation(pairs_of([files["r1"], files["q1"]]), features=("walls", "boundary"), seed=2)
    return run_ablation(asked, lambda _: None)[0], asked


def test_the_table_is_written_with_units_and_intervals(
    found: tuple[list[Experiment], Ablation], tmp_path: Path
) -> None:
    experiments, asked = found
    write_table(tmp_path / "t.csv", experiments, asked)
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for written, row in zip(rows, experiments[0].rows, strict=True):
        wide, narrow = row.result.success.values()
        assert (written["sensors"], written["stage"]) == ("laser", row.case.stage)
        assert int(written["within_1.5_m_right_views"]) == wide.successes
        assert int(written["within_0.5_m_on_map_views"]) == narrow.trials
        assert float(written["within_0.5_m_success_percent"]) == pytest.approx(100 * narrow.value, abs=1e-4)
        assert float(written["within_1.5_m_low_percent"]) == pytest.approx(100 * wide.interval[0], abs=1e-4)
        assert float(written["within_1.5_m_high_percent"]) == pytest.approx(100 * wide.interval[1], abs=1e-4)
        assert float(written["told_bits"]) == pytest.approx(row.told.bits, abs=1e-4)
        assert int(written["failures_views"]) == row.result.failures


def test_json_holds_the_same_rows_and_what_they_depend_on(
    found: tuple[list[Experiment], Ablation], tmp_path: Path
) -> None:
    experiments, asked = found
    write_table(tmp_path / "t.csv", experiments, asked)
    write_table(tmp_path / "t.json", experiments, asked)
    content = json.loads((tmp_path / "t.json").read_text())
    with (tmp_path / "t.csv").open(newline="") as file:
        as_text = [{key: "" if value is None else str(value) for key, value in row.items()} for row in content["rows"]]
        assert as_text == list(csv.DictReader(file))
    assert (content["seed"], content["features"]) == (2, ["walls", "boundary"])
    assert content["profile"] == asked.profile.to_dict()
    assert content["pairs"] == {"corridor, 16:00 → 18:00": [[str(path) for path in asked.pairs[0]]]}


def test_what_has_no_figure_is_empty_not_nan(found: tuple[list[Experiment], Ablation], tmp_path: Path) -> None:
    experiments, asked = found
    row = experiments[0].rows[0]
    assert row.proven is not None
    ruled_out = replace(row, proven=replace(row.proven, bits=-math.inf, error=math.inf))
    unknown = replace(row, proven=None)
    write_table(tmp_path / "t.json", [replace(experiments[0], rows=(ruled_out, unknown))], asked)
    content = json.loads((tmp_path / "t.json").read_text(), parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert [one["proven_bits"] for one in content["rows"]] == [None, None]


def test_the_table_on_the_terminal_keeps_within_80_columns(found: tuple[list[Experiment], Ablation]) -> None:
    experiment = found[0][0]
    row = experiment.rows[0]
    every = tuple(replace(row, case=case) for case in cases_of(ROBOT, every=True))
    said = printed(ablation_table(replace(experiment, rows=every)))
    assert "…" not in said
    assert said.splitlines()[0].startswith("corridor, 16:00 → 18:00: 14 views")
    assert len([line for line in said.splitlines() if "camera-1 + camera-2" in line]) == 1


def test_drives_come_in_pairs_and_tables_as_csv_or_json() -> None:
    paths = [Path(name) for name in "abc"]
    assert pairs_of(paths[:2]) == ((paths[0], paths[1]),)
    with pytest.raises(ScenarioError, match=r"^c: comes without a query; valid are pairs of a reference and a query$"):
        pairs_of(paths)
    with pytest.raises(ScenarioError, match=r"^t\.txt: is no table's name; valid are names that end in \.csv, \.json$"):
        check_table(Path("t.txt"))
    check_table(Path("t.CSV"))


def test_a_case_is_a_key() -> None:
    assert {Case("all", ROBOT, Stage.PRIOR): 1}[Case("all", ROBOT, Stage.PRIOR)] == 1
