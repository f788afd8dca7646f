"""Ground truth by picture: rules, files as others write them, and files that are none."""

import io
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from refseq.view import View
from refseq_bench.scenarios.datasets.ground_truth import FrameTable, PictureTruth, ground_truth
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.score import score
from tests.support import certain

CORRIDOR = Path(os.environ.get("REFSEQ_RECORDINGS", "none")) / "corridor" / "ground_truth.csv"


def answered(places: int, answers: list[int]) -> Comparison:
    """A comparison in which query k is answered with a place each."""
    views = [View(float(number)) for number in range(max(places, len(answers)))]
    beliefs = [certain(places, answer) for answer in answers]
    return Comparison("x", views[:places], {}, views[: len(answers)], {}, {"mine": beliefs})


def outcomes(text: str, places: int, answers: list[int], first: tuple[int, int] = (0, 0)) -> list[Outcome]:
    truth = PictureTruth(ground_truth(text), first)
    return list(score(truth.judging(answered(places, answers)), "mine", truth.tolerances[0]).outcomes)


Save = Callable[[Path, np.ndarray], None]
R, W, F = Outcome.RIGHT, Outcome.WRONG, Outcome.FALSE_FIX


@pytest.mark.parametrize("text", ["frame±2", "frame+-2", "frame+/-2", " frame ± 2 "])
def test_frames_within_so_many(text: str) -> None:
    # by hand: query k is right at k-2 to k+2; query 7 and 8 of 5 places are off the map
    assert outcomes(text, 5, [2, 4, 0, 0, 4, 3, 4, 4, 4]) == [R, W, R, W, R, R, R, F, F]


def test_a_query_that_begins_later() -> None:
    assert outcomes("frame+3±1", 6, [3, 3, 3]) == [R, R, W]
    assert outcomes("frame-2±1", 6, [0, 0, 0]) == [F, R, R]


def test_numbers_are_those_of_the_whole_folders() -> None:
    # places 10 and 11, queries 11 and 12
    assert outcomes("frame±1", 2, [1, 0], first=(10, 11)) == [R, W]


@pytest.fixture
def right() -> np.ndarray:
    """Six queries by five references; the fourth has none."""
    found = np.zeros((6, 5), bool)
    found[[0, 0, 1, 2, 4, 5], [0, 1, 1, 4, 2, 0]] = True
    return found


def save_csv(path: Path, right: np.ndarray) -> None:
    path.write_text("query,reference\n" + "\n".join(f"{q},{r}" for q, r in np.argwhere(right)))


def save_npy(path: Path, right: np.ndarray) -> None:
    np.save(path, right)


def save_npy_by_columns(path: Path, right: np.ndarray) -> None:
    np.save(path, np.asfortranarray(right.astype(np.float32)))


def save_tutorial(path: Path, right: np.ndarray) -> None:
    np.savez_compressed(path, GThard=np.eye(5, 6), GTsoft=right.T)


@pytest.mark.parametrize(
    ("name", "save"),
    [("a.csv", save_csv), ("a.npy", save_npy), ("b.npy", save_npy_by_columns), ("GT.npz", save_tutorial)],
)
def test_files_of_the_same_truth(tmp_path: Path, name: str, save: Save, right: np.ndarray) -> None:
    save(tmp_path / name, right)
    truth = PictureTruth(ground_truth(str(tmp_path / name)))
    for place in range(5):
        judged = truth.judging(answered(5, [place] * 6))
        found = score(judged, "mine", truth.tolerances[0]).outcomes
        assert [one is R for one in found] == right[:, place].tolist()
        assert found[3] is F


def test_one_right_reference_each(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", [2, -1, 0])
    assert outcomes(str(tmp_path / "a.npy"), 3, [2, 2, 2]) == [R, F, W]


@pytest.mark.skipif(not CORRIDOR.exists(), reason="the corridor set is not in REFSEQ_RECORDINGS")
def test_the_corridor_sets_own_truth_is_two_pictures_to_both_sides() -> None:
    found = ground_truth(str(CORRIDOR))
    assert isinstance(found, FrameTable)
    assert len(found.right) == 111
    for query, frames in found.right.items():
        assert sorted(frames) == [k for k in range(query - 2, query + 3) if 0 <= k < 111]


def bomb(path: Path) -> None:
    """An array that declares 8 TB and holds nothing."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)})
    path.write_bytes(header.getvalue())


def pickled(path: Path) -> None:
    """As VPR-Bench's ground_truth_new.npy: numbers and lists of numbers as objects."""
    rows = np.empty((2, 2), object)
    rows[0], rows[1] = [0, [0, 1]], [1, [1]]
    np.save(path, rows, allow_pickle=True)


@pytest.mark.parametrize(
    ("name", "make", "message"),
    [
        ("a.npy", pickled, r"a.npy holds pickled objects, which are programs and are not run; valid is an"),
        ("a.npy", bomb, r"is declared as \(1000000, 1000000\) of float64; valid are"),
        ("a.npy", lambda path: path.write_bytes(b"hello"), "is no NumPy array"),
        ("a.npy", lambda path: np.save(path, np.zeros((3, 2, 2))), r"is of shape \(3, 2, 2\); valid are"),
        ("a.npy", lambda path: np.save(path, [[0, 5]]), r"of shape \(1, 2\), holds other numbers; valid are"),
        ("a.npy", lambda path: np.save(path, [0.5]), "holds 0.5; valid are"),
        ("a.npz", lambda path: path.write_bytes(b"hello"), "is no .npz, or is damaged"),
        ("a.npz", lambda path: np.savez(path, a=[1], b=[2]), "holds the arrays a, b; valid is GTsoft, GThard, or one"),
        ("a.csv", lambda path: path.write_text(""), "holds no row; valid are rows of query,reference"),
        ("a.csv", lambda path: path.write_text("query,reference\n1,x\n"), "line 2: '1,x' is no row of it; valid are"),
        ("a.csv", lambda path: path.write_text("1,5,3\n"), "line 1: reference pictures 5 to 3; valid are"),
        ("a.mat", lambda path: path.write_text(""), "is no ground truth; valid are frame±N and files that end in"),
    ],
)  # fmt: skip
def test_files_that_are_none(tmp_path: Path, name: str, make: Callable[[Path], object], message: str) -> None:
    make(tmp_path / name)
    with pytest.raises(ScenarioError, match=message) as told:
        ground_truth(str(tmp_path / name))
    assert str(told.value).startswith(str(tmp_path / name))
    assert "\n" not in str(told.value)


def test_a_zip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|b1", "fortran_order": False, "shape": (10**5, 10**5)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("GTsoft.npy", header.getvalue() + bytes(10**6))
    with pytest.raises(ScenarioError, match=r"GTsoft is declared as \(100000, 100000\) of bool"):
        ground_truth(str(tmp_path / "a.npz"))


def test_rules_and_tables_that_do_not_fit(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"'frame±0': within 0 pictures is not valid; it should be 1 or more"):
        ground_truth("frame±0")
    with pytest.raises(ScenarioError, match=r"'frame~2' is no file; valid are frame±N, frame\+SHIFT±N, and a file"):
        ground_truth("frame~2")
    np.save(tmp_path / "a.npy", [0, 1, 2])
    with pytest.raises(ScenarioError, match=r"a.npy: is of 3 queries; valid are 2, one a picture"):
        outcomes(str(tmp_path / "a.npy"), 3, [0, 0])
    with pytest.raises(ScenarioError, match=r"a.npy: names reference picture 2; valid are 0 to 1"):
        outcomes(str(tmp_path / "a.npy"), 2, [0, 0, 0])
