from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rich.console import Console
from rich.table import Table

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import feature_information, neighbour_noise, view_information
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps.drawings import matrix as matrices
from refseq_bench.scenarios.maps.drawings.matrix import check_picture, draw
from refseq_bench.scenarios.maps.matrix import (
    features_table,
    information_table,
    statistics_table,
    summaries,
    top_features,
)

quick = settings(derandomize=True)


def packed(**blocks: np.ndarray) -> IncidenceMatrix:
    """The matrix of dense blocks; ``sift_camera`` is the extractor ``sift/camera``."""
    named = {key.replace("_", "/"): np.asarray(block, bool) for key, block in blocks.items()}
    K = next(iter(named.values())).shape[1]
    columns = [{key: np.flatnonzero(block[:, k]) for key, block in named.items()} for k in range(K)]
    return IncidenceMatrix.from_columns(columns, {key: len(block) for key, block in named.items()})


@pytest.fixture(scope="module")
def house() -> IncidenceMatrix:
    """Words that are seen at a few neighbouring places each, and two extractors of the laser."""
    rng = np.random.default_rng(0)
    words = np.abs(np.arange(24) - rng.integers(24, size=(90, 1))) < rng.integers(1, 4, size=(90, 1))
    return packed(sift_camera=words, walls_laser=rng.random((9, 24)) < 0.4, boundary_laser=rng.random((4, 24)) < 0.7)


# --- figures ---


def test_extractors_sensors_with_several_and_all_are_summed_up(house: IncidenceMatrix) -> None:
    found = {one.name: one for one in summaries(house, np.random.default_rng(0))}
    assert list(found) == ["sift/camera", "walls/laser", "boundary/laser", "laser", "all"]
    assert [one.statistics.features for one in found.values()] == [90, 9, 4, 13, 103]
    assert found["laser"].statistics == house.statistics(range(90, 99), range(99, 103))
    assert found["walls/laser"].noise == neighbour_noise(house, range(90, 99))
    assert found["all"].noise is None
    bits = {name: one.told.bits for name, one in found.items()}
    assert max(bits["walls/laser"], bits["boundary/laser"]) < bits["laser"] < bits["all"]
    noise = {"walls/laser": found["walls/laser"].noise, "boundary/laser": found["boundary/laser"].noise}
    again = view_information(house, noise, np.random.default_rng(5), draws=4000)  # type: ignore[arg-type]
    assert abs(again.bits - bits["laser"]) < 4 * found["laser"].told.error
    assert all(one.told.bits <= one.distinct.bits + 4 * one.told.error for one in found.values())


def names(matrix: IncidenceMatrix) -> list[str]:
    """Summaries of one view each, as it takes time to say how much they tell."""
    return [one.name for one in summaries(matrix, np.random.default_rng(0), draws=1)]


def test_a_single_extractor_is_not_summed_up_twice() -> None:
    assert names(packed(sift_camera=np.eye(4))) == ["sift/camera"]
    lasers = packed(walls_laser=np.eye(4), boundary_laser=np.eye(4))
    assert names(lasers) == ["walls/laser", "boundary/laser", "all"]


def test_cameras_named_as_topics_are_summed_up_apart() -> None:
    sizes = {"sift/front/left": 4, "dense/front/left": 4, "sift/rear/left": 4}
    matrix = IncidenceMatrix.from_columns([{key: np.array([k]) for key in sizes} for k in range(4)], sizes)
    assert names(matrix) == [*sizes, "front/left", "all"]


def test_more_views_leave_a_smaller_error(house: IncidenceMatrix) -> None:
    few, many = (summaries(house, np.random.default_rng(0), draws=draws)[-1].told for draws in (30, 480))
    assert few.error / many.error == pytest.approx(4.0, rel=0.5), "as the root of their number"


def test_the_features_that_tell_the_most_come_first(house: IncidenceMatrix) -> None:
    everything = {
        f"{key} {number}": bits
        for key, block in house.blocks.items()
        for number, bits in enumerate(feature_information(house, block, neighbour_noise(house, block)))
    }
    found = top_features(house, 12)
    assert [one.told for one in found] == sorted(everything.values(), reverse=True)[:12]
    for one in found:
        key, number = one.name.rsplit(" ", 1)
        seen = np.flatnonzero(house.rows(np.array([house.blocks[key][int(number)]]))[0])
        assert (one.sightings, one.first, one.last) == (len(seen), seen[0], seen[-1])
        assert one.told == everything[one.name]
        assert one.distinct == feature_information(house, house.blocks[key])[int(number)]


def test_what_was_never_seen_is_no_top_feature() -> None:
    found = top_features(packed(walls_laser=[[0, 0, 0, 0], [1, 1, 0, 0]]), 10)
    assert [one.name for one in found] == ["walls/laser 1"]


@pytest.mark.slow
def test_tables_of_a_large_map_keep_within_80_columns() -> None:
    words = np.arange(45_000)[:, None] % 40 == np.arange(40)
    wide = packed(sift_camera=words, boundary_laser=np.eye(40), walls_laser=np.eye(40))
    found = summaries(wide, np.random.default_rng(0))
    for table in (statistics_table("t", found), information_table(found), features_table(top_features(wide, 5))):
        assert "…" not in printed(table)


def printed(table: Table) -> str:
    console = Console(width=80, no_color=True)
    with console.capture() as said:
        console.print(table)
    return said.get()


# --- picture ---


@quick
@given(
    st.tuples(st.integers(1, 14), st.integers(1, 9)).flatmap(lambda shape: arrays(np.bool_, shape)),
    st.integers(1, 16),
    st.integers(1, 12),
    st.data(),
)
def test_a_pixel_is_as_dark_as_its_share_of_sightings(
    dense: np.ndarray, height: int, width: int, data: st.DataObject
) -> None:
    above = data.draw(st.integers(0, 3))
    matrix = packed(a=np.ones((above, dense.shape[1])), b=dense)
    drawn = matrices._shares(matrix, matrix.blocks["b"], height, width)
    firsts = [int(np.argmax(row)) if row.any() else dense.shape[1] for row in dense]
    ordered = dense[np.argsort(firsts, kind="stable")]
    h, w = drawn.shape
    assert (h, w) == (min(height, dense.shape[0]), min(width, dense.shape[1]))
    rows, columns = np.arange(len(dense)) * h // len(dense), np.arange(dense.shape[1]) * w // dense.shape[1]
    for i in range(h):
        for j in range(w):
            assert drawn[i, j] == pytest.approx(ordered[np.ix_(rows == i, columns == j)].mean())


def test_new_features_make_a_diagonal_from_the_top_left() -> None:
    shuffled = np.eye(6)[[3, 0, 5, 1, 4, 2]]
    matrix = packed(sift_camera=shuffled)
    np.testing.assert_array_equal(matrices._shares(matrix, range(6), 100, 100), np.eye(6))


def test_the_picture_is_black_where_features_were_seen(tmp_path: Path) -> None:
    seen = np.kron([[1, 0], [0, 1]], np.ones((20, 5)))
    matrix = packed(sift_camera=seen, walls_laser=seen[:4])
    draw(tmp_path / "m.png", matrix, "a title")
    picture = cv2.imread(str(tmp_path / "m.png"), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    left, top = matrices.LEFT, matrices.TOP
    height, width = matrices._heights([40, 4])[0], matrices.WIDTH
    panel = picture[top : top + height, left : left + width]
    quarters = [[panel[y, x] for x in (width // 4, 3 * width // 4)] for y in (height // 4, 3 * height // 4)]
    assert quarters == [[0, 255], [255, 0]]
    assert (panel < 10).mean() == pytest.approx(0.5, abs=0.01)


@pytest.mark.slow_cases("png", "pdf")
@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_a_picture_is_written_in_one_step_and_the_same_each_time(tmp_path: Path, ending: str) -> None:
    one, two = tmp_path / f"one.{ending}", tmp_path / f"two.{ending}"
    for path in (one, two):
        check_picture(path)
        draw(path, packed(sift_camera=np.eye(3)), "a title")
    assert one.read_bytes() == two.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [one.name, two.name]


def test_an_extractor_without_features_and_a_single_place_are_drawn(tmp_path: Path) -> None:
    draw(tmp_path / "m.png", packed(sift_camera=np.zeros((0, 1)), walls_laser=np.ones((2, 1))), "one place")
    assert (tmp_path / "m.png").stat().st_size > 1000


def test_another_format_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"^m\.bmp: is no picture's name; valid are names that end in \.png, "):
        check_picture(Path("m.bmp"))
