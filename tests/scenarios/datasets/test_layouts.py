"""Data sets recognised by their folders."""

from pathlib import Path

import pytest

from refseq_bench.scenarios.datasets.layouts import dataset_pairs, is_dataset
from refseq_bench.scenarios.errors import ScenarioError


def folders(home: Path, *names: str) -> Path:
    for name in names:
        (home / name).mkdir(parents=True)
    return home


def pairs(home: Path, layout: str | None = None) -> list[tuple[str, str, str | None]]:
    found = dataset_pairs(home, layout)
    return [(one.reference.name, one.query.name, one.truth and Path(one.truth).name) for one in found]


def test_gardens_point(tmp_path: Path) -> None:
    folders(tmp_path, "day_left", "day_right", "night_right")
    assert pairs(tmp_path) == [
        ("day_left", "day_right", "frame±2"),
        ("day_right", "night_right", "frame±2"),
        ("day_left", "night_right", "frame±2"),
    ]


def test_nordland_in_two_seasons(tmp_path: Path) -> None:
    assert pairs(folders(tmp_path, "summer", "winter")) == [("summer", "winter", "frame±10")]


@pytest.mark.parametrize("truth", ["ground_truth.csv", "GT.npz", "ground_truth_new.npy"])
def test_vpr_bench_with_its_file(tmp_path: Path, truth: str) -> None:
    folders(tmp_path, "ref", "query")
    assert pairs(tmp_path) == [("ref", "query", None)]
    (tmp_path / truth).touch()
    assert pairs(tmp_path) == [("ref", "query", truth)]


def test_a_folder_of_data_sets(tmp_path: Path) -> None:
    folders(tmp_path, "one/ref", "one/query", "two/day_right", "two/night_right", "three")
    assert pairs(tmp_path) == [("ref", "query", None), ("day_right", "night_right", "frame±2")]
    assert pairs(tmp_path, "gardens-point") == [("day_right", "night_right", "frame±2")]


def test_folders_that_are_none(tmp_path: Path) -> None:
    folders(tmp_path, "left", "right")
    assert not is_dataset(tmp_path)
    with pytest.raises(ScenarioError, match=r"is laid out as no data set \(its folders: left, right\); valid are gard"):
        dataset_pairs(tmp_path)
    with pytest.raises(ScenarioError, match=r"its folders: left, right\); valid are nordland: spring and summer$"):
        dataset_pairs(tmp_path, "nordland")
    with pytest.raises(ScenarioError, match=r"layout 'oxford' is unknown; valid are gardens-point, nordland"):
        dataset_pairs(tmp_path, "oxford")
    with pytest.raises(ScenarioError, match=r"none: is no folder; valid is that of a data set"):
        dataset_pairs(tmp_path / "none")
