import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.inference.matching.incidence import IncidenceMatrix

quick = settings(derandomize=True)
dense_matrices = st.tuples(st.integers(0, 12), st.integers(1, 9)).flatmap(lambda shape: arrays(np.bool_, shape))


def packed(dense: np.ndarray, split: int) -> IncidenceMatrix:
    """The matrix of two extractors, the first with ``split`` features."""
    columns = [{"a": np.flatnonzero(column[:split]), "b": np.flatnonzero(column[split:])} for column in dense.T]
    return IncidenceMatrix.from_columns(columns, {"a": split, "b": len(dense) - split})


@quick
@given(dense_matrices, st.data())
def test_is_the_dense_matrix(dense: np.ndarray, data: st.DataObject) -> None:
    N, K = dense.shape
    matrix = packed(dense, data.draw(st.integers(0, N)))
    assert (matrix.N, matrix.K) == (N, K)
    ids = np.array(data.draw(st.lists(st.integers(0, N - 1)) if N else st.just([])), np.intp)
    np.testing.assert_array_equal(matrix.rows(ids), dense[ids])
    for place in range(K):
        np.testing.assert_array_equal(matrix.column(place), np.flatnonzero(dense[:, place]))
    assert [list(ids) for ids in matrix.columns()] == [list(np.flatnonzero(column)) for column in dense.T]
    some = np.array(sorted(data.draw(st.sets(st.integers(0, K - 1)))), np.intp)
    assert [list(ids) for ids in matrix.columns_of(some)] == [list(np.flatnonzero(dense[:, k])) for k in some]
    for key, block in matrix.blocks.items():
        np.testing.assert_array_equal(matrix.block(key).dense(), dense[block.start : block.stop])
        shown = [matrix.by_block(column)[key] for column in matrix.columns()]
        rows = dense[block.start : block.stop]
        assert [list(ids) for ids in shown] == [list(np.flatnonzero(column)) for column in rows.T]


@quick
@given(dense_matrices)
def test_rows_survive_from_rows(dense: np.ndarray) -> None:
    matrix = packed(dense, 0)
    again = IncidenceMatrix.from_rows(matrix.pointers, matrix.places, matrix.K, {"a": 0, "b": len(dense)})
    np.testing.assert_array_equal(again.rows(np.arange(len(dense))), dense)
    assert again.blocks == matrix.blocks


def test_blocks_are_each_extractor_s_rows() -> None:
    matrix = IncidenceMatrix.from_columns([{"b": np.array([1])}, {"a": np.array([0])}], {"a": 3, "b": 2, "c": 4})
    assert matrix.blocks == {"a": range(3), "b": range(3, 5), "c": range(5, 9)}
    np.testing.assert_array_equal(matrix.rows(np.array([4, 0])), [[True, False], [False, True]])


def test_a_matrix_without_extractors_has_columns_without_blocks() -> None:
    matrix = IncidenceMatrix.from_columns([{}], {})
    assert [matrix.by_block(column) for column in matrix.columns()] == [{}]


def test_a_place_without_a_sensor_has_none_of_its_features() -> None:
    matrix = IncidenceMatrix.from_columns([{}, {"a": np.array([0, 1])}, {}], {"a": 2})
    assert [len(ids) for ids in matrix.columns()] == [0, 2, 0]


@pytest.mark.parametrize("wrong", [3, -1])
def test_a_feature_that_an_extractor_does_not_have_is_refused(wrong: int) -> None:
    with pytest.raises(ValueError, match=rf"^a has seen feature {wrong}; valid are 0 to 2$"):
        IncidenceMatrix.from_columns([{"a": np.array([0, wrong]), "b": np.array([0])}], {"a": 3, "b": 9})


# --- appending ---


@st.composite
def growing_drives(draw: st.DrawFn) -> tuple[list[dict[str, np.ndarray]], list[dict[str, int]]]:
    """Columns of some places, and after each of them the sizes of vocabularies that grow; a sensor may come late."""
    count = draw(st.integers(1, 7))
    late = draw(st.integers(0, count))
    sizes, columns, known = [], [], {"a": 0, "b": draw(st.integers(0, 3))}
    for place in range(count):
        if place == late:
            known["c"] = 0
        known = {key: size + draw(st.integers(0, 3)) for key, size in known.items()}
        seen = {key: draw(st.sets(st.integers(0, size - 1))) if size else set() for key, size in known.items()}
        missing = draw(st.sets(st.sampled_from(sorted(known))))
        columns.append({key: np.array(sorted(ids), np.intp) for key, ids in seen.items() if key not in missing})
        sizes.append(known)
    return columns, sizes


def assert_same(one: IncidenceMatrix, other: IncidenceMatrix) -> None:
    assert (one.K, one.blocks) == (other.K, other.blocks)
    for name in ("pointers", "places"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert getattr(one, name).dtype == getattr(other, name).dtype


@quick
@given(growing_drives(), st.data())
def test_appended_place_by_place_or_many_together_is_packed_at_once(
    drive: tuple[list[dict[str, np.ndarray]], list[dict[str, int]]], data: st.DataObject
) -> None:
    columns, sizes = drive
    whole = IncidenceMatrix.from_columns(columns, sizes[-1])
    one_by_one = IncidenceMatrix.from_columns([], {})
    for column, known in zip(columns, sizes, strict=True):
        one_by_one = one_by_one.appended([column], known)
    assert_same(one_by_one, whole)
    cut = data.draw(st.integers(1, len(columns)))
    assert_same(IncidenceMatrix.from_columns(columns[:cut], sizes[cut - 1]).appended(columns[cut:], sizes[-1]), whole)


def test_appending_leaves_the_matrix_as_it_was() -> None:
    matrix = IncidenceMatrix.from_columns([{"a": np.array([0])}], {"a": 1})
    longer = matrix.appended([{"a": np.array([0, 1])}], {"a": 2})
    np.testing.assert_array_equal(longer.rows(np.arange(2)), [[True, True], [False, True]])
    np.testing.assert_array_equal(matrix.rows(np.arange(1)), [[True]])
    assert (matrix.N, matrix.K) == (1, 1)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ({"a": 2, "b": 4}, "b has 4 features; valid are 5 and more"),
        ({"b": 5, "a": 2}, "extractors are b, a; valid are a, b, and new ones"),
        ({"a": 2}, "extractors are a; valid are a, b, and new ones"),
    ],
)
def test_a_vocabulary_that_shrank_is_refused(sizes: dict[str, int], message: str) -> None:
    matrix = IncidenceMatrix.from_columns([{}], {"a": 2, "b": 5})
    with pytest.raises(ValueError, match=f"^{message}$"):
        matrix.appended([], sizes)


# --- statistics ---


@quick
@given(dense_matrices, st.data())
def test_statistics_are_those_of_the_dense_matrix(dense: np.ndarray, data: st.DataObject) -> None:
    N, K = dense.shape
    split = data.draw(st.integers(0, N))
    matrix = packed(dense, split)
    for blocks, rows in (
        ((), dense),
        ((matrix.blocks["b"],), dense[split:]),
        ((matrix.blocks["a"], matrix.blocks["b"]), dense),
    ):
        found = matrix.statistics(*blocks)
        sightings, a_view = rows.sum(axis=1), rows.sum(axis=0)
        assert (found.features, found.places, found.entries) == (len(rows), K, rows.sum())
        assert (found.everywhere, found.nowhere) == ((sightings == K).sum(), (sightings == 0).sum())
        assert found.constant == (rows == rows[:, :1]).all(axis=1).sum()
        assert found.once == (sightings == 1).sum()
        assert (found.fewest, found.median, found.most) == (a_view.min(), np.median(a_view), a_view.max())
        assert found.sparsity == pytest.approx(1 - rows.mean() if rows.size else 1)
        assert found.bytes_a_place * K == pytest.approx(8 * len(rows) + 4 * rows.sum())


def test_a_matrix_without_places_has_statistics() -> None:
    found = IncidenceMatrix.from_columns([], {"a": 3}).statistics()
    assert (found.features, found.places, found.constant, found.most, found.sparsity) == (3, 0, 3, 0, 1)


def test_rows_of_a_sensor_are_those_of_its_extractors() -> None:
    sizes = {"sift/camera-1": 5, "walls/laser": 9, "sift/camera-2": 3, "boundary/laser": 2}
    matrix = IncidenceMatrix.from_columns([{}], sizes)
    assert matrix.sensors == {
        "camera-1": (range(5),),
        "laser": (range(5, 14), range(17, 19)),
        "camera-2": (range(14, 17),),
    }
    np.testing.assert_array_equal(matrix.sightings(range(14, 17)), [0, 0, 0])


def test_a_block_as_zeros_and_ones_is_its_rows() -> None:
    dense = np.random.default_rng(4).random((7, 5)) < 0.4
    columns = [{"a": np.flatnonzero(column[:3]), "b": np.flatnonzero(column[3:])} for column in dense.T]
    matrix = IncidenceMatrix.from_columns(columns, {"a": 3, "b": 4})
    for key, rows in (("a", dense[:3]), ("b", dense[3:])):
        np.testing.assert_array_equal(matrix.zeros_and_ones(matrix.blocks[key]).toarray(), rows)


def test_sensors_whose_names_end_alike_after_a_slash_are_two() -> None:
    """A camera may be named as its topic is."""
    sizes = {"sift/front/left": 2, "dense/front/left": 1, "sift/rear/left": 3}
    matrix = IncidenceMatrix.from_columns([{}], sizes)
    assert matrix.sensors == {"front/left": (range(2), range(2, 3)), "rear/left": (range(3, 6),)}


@pytest.mark.parametrize(
    ("pointers", "places", "message"),
    [
        ([0, 1, 2], [0, 1], "pointers do not rise from 0 to 2 in 3 steps"),
        ([1, 1, 1, 2], [0, 1], "pointers do not rise from 0 to 2 in 3 steps"),
        ([0, 1, 1, 1], [0, 1], "pointers do not rise from 0 to 2 in 3 steps"),
        ([0, 2, 1, 2], [0, 1], "pointers do not rise from 0 to 2 in 3 steps"),
        ([0, 1, 1, 2], [0, 4], "a feature is at place 4; valid are 0 to 3"),
        ([0, 1, 1, 2], [-1, 3], "a feature is at place -1; valid are 0 to 3"),
    ],
)
def test_arrays_that_are_no_matrix_are_refused(pointers: list[int], places: list[int], message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        IncidenceMatrix.from_rows(np.array(pointers), np.array(places, np.int32), 4, {"a": 3})
    assert str(caught.value) == message
