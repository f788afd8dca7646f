from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from refseq.belief import LOST, Belief, PoseBeside, Stage, Timings
from refseq.errors import LogError
from refseq.fault import CLOCK, DeclaredFault, FaultKind
from refseq.limits import Limit
from refseq.logs.beliefs import read_beliefs, write_beliefs
from refseq.logs.beliefs import table as beliefs_module
from refseq.logs.beliefs.table import BESIDE, SCHEMA
from refseq.planar import Pose
from refseq.view import View

STAMPS = DeclaredFault(CLOCK, FaultKind.JUMPING, 0, -5.0, 20.0)


def random_belief(rng: np.random.Generator) -> Belief:
    places = rng.dirichlet(np.ones(7))
    entropy = float(-(places * np.log(places)).sum())
    timings = Timings(*rng.random(4).tolist())
    ill = DeclaredFault("camera-1", FaultKind.BLANK, 0, 0.1, float(rng.random())), STAMPS
    faults = ill[: rng.integers(3)]
    lost = float(rng.random())
    lost_after = (None, lost * rng.dirichlet(np.ones(8))[1:])[rng.integers(2)]
    root = rng.normal(size=(3, 3))
    pose = (None, PoseBeside(*rng.normal(size=3).tolist(), root @ root.T))[rng.integers(2)]
    return Belief(places, lost, int(np.argmax(places)), (3, LOST, 4), entropy, timings, faults, lost_after, pose)


@pytest.fixture
def drive() -> tuple[list[View], dict[Stage, list[Belief]]]:
    rng = np.random.default_rng(0)
    # More than nine views: their order must not be that of their names.
    views = [View(0.1 * k, truth=None if k == 3 else Pose(k, -k, 0.1 * k)) for k in range(12)]
    return views, {stage: [random_belief(rng) for _ in views] for stage in (Stage.CHAIN, Stage.UNIFORM)}


def test_round_trip_is_exact(tmp_path: Path, drive: tuple[list[View], dict[Stage, list[Belief]]]) -> None:
    views, beliefs = drive
    write_beliefs(tmp_path / "b.parquet", views, beliefs)
    read = read_beliefs(tmp_path / "b.parquet")
    assert list(read) == [Stage.UNIFORM, Stage.CHAIN]
    for stage, answers in beliefs.items():
        for ours, theirs in zip(answers, read[stage], strict=True):
            assert ours.places.tobytes() == theirs.places.tobytes()
            assert (ours.lost, ours.best, ours.path) == (theirs.lost, theirs.best, theirs.path)
            assert (ours.entropy, ours.timings) == (theirs.entropy, theirs.timings)
            assert ours.faults == theirs.faults
            np.testing.assert_array_equal(ours.lost_after, theirs.lost_after)
            assert ours.last_sure == theirs.last_sure
            assert (ours.pose is None) == (theirs.pose is None)
            if ours.pose is not None and theirs.pose is not None:
                assert ours.pose.motion == theirs.pose.motion
                assert ours.pose.covariance.tobytes() == theirs.pose.covariance.tobytes()
    assert {len(belief.faults) for belief in beliefs[Stage.CHAIN]} == {0, 1, 2}
    assert {belief.pose is None for belief in beliefs[Stage.CHAIN]} == {False, True}


def test_a_table_of_an_earlier_version_tells_no_fault_lost_place_or_pose(tmp_path: Path, table: pa.Table) -> None:
    pq.write_table(table.drop_columns(["faults", "lost_after", *BESIDE]), tmp_path / "b.parquet")
    beliefs = read_beliefs(tmp_path / "b.parquet")[Stage.CHAIN]
    assert not any(belief.faults for belief in beliefs)
    assert {belief.lost_after is None for belief in beliefs} == {True}
    assert {belief.pose is None for belief in beliefs} == {True}


def test_a_part_of_a_pose_and_what_is_no_covariance_are_refused(tmp_path: Path, table: pa.Table) -> None:
    rows = table.to_pylist()
    row = next(row for row in rows if row[BESIDE[0]] is not None)
    whole = list(row["beside_covariance"])
    for name, value, told in (
        ("beside_aside_m", None, "has a part of beside_along_m"),
        ("beside_covariance", whole[:8], r"covariance of \(8,\); valid are"),
        ("beside_covariance", [-1.0, *whole[1:]], "is none; valid is symmetric"),
        ("beside_covariance", [whole[0], whole[1] + 1.0, *whole[2:]], "is none; valid is symmetric"),
    ):
        damaged = [{**one, name: value} if one is row else one for one in rows]
        pq.write_table(pa.Table.from_pylist(damaged, schema=SCHEMA), tmp_path / "b.parquet")
        with pytest.raises(LogError, match=told):
            read_beliefs(tmp_path / "b.parquet")


def test_columns_carry_units_and_truth(tmp_path: Path, drive: tuple[list[View], dict[Stage, list[Belief]]]) -> None:
    views, beliefs = drive
    write_beliefs(tmp_path / "b.parquet", views, beliefs, {"map": "hallway"})
    table = pq.read_table(tmp_path / "b.parquet")
    assert table.schema.metadata[b"refseq"] == b'{"map": "hallway"}'
    assert table.num_rows == 2 * len(views)
    assert table["time_s"].to_pylist()[:12] == [view.time for view in views]
    assert table["true_x_m"].to_pylist()[:5] == [0, 1, 2, None, 4]
    assert {"entropy_nats", "true_heading_rad", "features_s", "chain_s"} <= set(table.column_names)


def test_as_many_beliefs_as_views(tmp_path: Path, drive: tuple[list[View], dict[Stage, list[Belief]]]) -> None:
    views, beliefs = drive
    with pytest.raises(ValueError, match="zip"):
        write_beliefs(tmp_path / "b.parquet", views[:-1], beliefs)
    assert list(tmp_path.iterdir()) == []


def error_of(path: Path) -> str:
    with pytest.raises(LogError) as caught:
        read_beliefs(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_files_that_are_no_beliefs(tmp_path: Path) -> None:
    path = tmp_path / "b.parquet"
    assert error_of(path).startswith(f"{path}: is no table of beliefs: ")
    path.write_text("method,view")
    assert error_of(path).startswith(f"{path}: is no table of beliefs: ")
    pq.write_table(pa.table({"method": ["chain"], "view": pa.array([0], pa.int32())}), path)
    assert error_of(path) == f"{path}: is no table of beliefs: column 'time_s' is missing, or there twice"


def test_any_method_is_kept_and_the_stages_come_first(tmp_path: Path) -> None:
    path = tmp_path / "b.parquet"
    belief = Belief(np.array([0.25, 0.75]), 0.1, 1, (0, 1), 0.5)
    write_beliefs(path, [View(0.0)], {"own:Localiser": [belief], "chain": [belief], "uniform": [belief]})
    found = read_beliefs(path)
    assert list(found) == ["uniform", "chain", "own:Localiser"]
    assert found["own:Localiser"][0].places.tolist() == [0.25, 0.75]


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "no" / "b.parquet"
    with pytest.raises(LogError) as caught:
        write_beliefs(path, [], {})
    assert str(caught.value) == f"{path}: cannot be written: No such file or directory"


def test_a_column_of_another_type_is_named(tmp_path: Path) -> None:
    path = tmp_path / "beliefs.parquet"
    columns = {field.name: pa.nulls(1, field.type) for field in SCHEMA}
    pq.write_table(pa.table(columns | {"best": pa.array(["7"])}), path)
    assert error_of(path) == f"{path}: column 'best' holds string; valid is int32"


def test_a_bit_that_turned_over_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "beliefs.parquet"
    rng = np.random.default_rng(3)
    write_beliefs(path, [View(float(k)) for k in range(40)], {"chain": [random_belief(rng) for _ in range(40)]})
    whole = path.read_bytes()
    places = whole.index(np.array(read_beliefs(path)["chain"][0].places[:1]).tobytes())
    path.write_bytes(whole[:places] + bytes([whole[places] ^ 1]) + whole[places + 1 :])
    assert "is no table of beliefs" in error_of(path)


@pytest.fixture
def table(tmp_path: Path, drive: tuple[list[View], dict[Stage, list[Belief]]]) -> pa.Table:
    write_beliefs(tmp_path / "whole.parquet", *drive)
    return pq.read_table(tmp_path / "whole.parquet")


def changed(table: pa.Table, column: str, value: object) -> pa.Table:
    """The same table with another value in the last row."""
    number = table.column_names.index(column)
    kind = table.schema.field(number).type
    return table.set_column(number, column, pa.array([*table.column(number).to_pylist()[:-1], value], kind))


TOLD = {"sensor": "laser", "kind": "blind", "since": 1, "time_s": 0.5, "evidence_nats": 10.0}


@pytest.mark.parametrize(
    ("column", "value", "told"),
    [
        ("lost", None, "column 'lost' lacks a value; valid is one in every row"),
        ("places", [None], "column 'places' lacks a value; valid is one in every row"),
        ("lost", -0.5, "column 'lost' holds -0.5; valid are 0 to 1"),
        ("lost", float("nan"), "column 'lost' holds nan; valid are 0 to 1"),
        ("places", [-0.5, 1.5], "column 'places' holds -0.5; valid are 0 to 1"),
        ("places", [0.5, 0.25], "the probabilities of 2 places sum to 0.75; valid is 1"),
        ("places", [], "the probabilities of 0 places sum to 0; valid is 1"),
        ("best", 10_000, "best is place 10000; valid are 0 to"),
        ("path", [10_000], "path is place 10000; valid are 0 to"),
        ("path", [-2], "column 'path' holds -2; valid are -1 to"),
        ("faults", None, "column 'faults' lacks a value; valid is one in every row"),
        ("faults", [None], "column 'faults' lacks a value; valid is one in every row"),
        ("faults", [TOLD | {"kind": "bored"}], "kind of fault 'bored' is not valid; valid are blank, frozen"),
        ("faults", [TOLD | {"since": 12}], "a fault since view 12; valid are 0 to 11"),
        ("faults", [TOLD | {"since": None}], "a fault since view None; valid are 0 to 11"),
        ("faults", [TOLD | {"sensor": None}], "a fault lacks its sensor, time or evidence"),
        ("faults", [TOLD | {"time_s": float("nan")}], "a fault lacks its sensor, time or evidence"),
        ("lost_after", [0.0] * 6, "lost_after has 6 numbers; valid is 7, one a place"),
        ("lost_after", [1.0] * 7, "lost_after sums to 7; valid is at most lost, 0."),
        ("lost_after", [float("nan")] * 7, "column 'lost_after' holds nan; valid are 0 to 1"),
        ("lost_after", [None] * 7, "column 'lost_after' lacks a value; valid is one in every row"),
        ("view", 7000, "answers view 7000; valid is"),
        ("true_x_m", float("inf"), "column 'true_x_m' holds inf; valid are -1e+09 to 1e+09"),
    ],
)
def test_rows_that_are_no_beliefs(tmp_path: Path, table: pa.Table, column: str, value: object, told: str) -> None:
    path = tmp_path / "b.parquet"
    pq.write_table(changed(table, column, value), path)
    assert error_of(path).startswith(f"{path}: ")
    assert told in error_of(path)


def test_more_than_a_table_may_hold(tmp_path: Path, table: pa.Table, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of equal values take nothing on the disk."""
    monkeypatch.setattr(beliefs_module, "BELIEF_BYTES", Limit(2**20, "bytes", ""))
    path = tmp_path / "b.parquet"
    pq.write_table(changed(table, "places", [2.0**-18] * 2**18), path, compression="zstd")
    assert path.stat().st_size < 2**16
    assert "valid are at most 1048576" in error_of(path)
