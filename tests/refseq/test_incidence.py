import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.incidence import IncidenceMatrix

quick = settings(deadline=None, max_examples=80, derandomize=True)
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


def test_a_place_without_a_sensor_has_none_of_its_features() -> None:
    matrix = IncidenceMatrix.from_columns([{}, {"a": np.array([0, 1])}, {}], {"a": 2})
    assert [len(ids) for ids in matrix.columns()] == [0, 2, 0]


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
