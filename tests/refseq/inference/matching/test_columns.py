import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.inference.matching.columns import LONG, Rows, distinct_columns

quick = settings(derandomize=True)
matrices = st.tuples(st.integers(0, 140), st.integers(1, 12)).flatmap(
    lambda shape: st.one_of(
        arrays(np.bool_, shape),
        # Columns that differ in a few rows only, or not at all.
        st.lists(st.tuples(st.integers(0, max(0, shape[0] - 1)), st.integers(0, shape[1] - 1)), max_size=6).map(
            lambda ones: sparse_matrix(shape, ones)
        ),
    )
)


def sparse_matrix(shape: tuple[int, int], ones: list[tuple[int, int]]) -> np.ndarray:
    matrix = np.zeros(shape, bool)
    if shape[0]:
        for row, place in ones:
            matrix[row, place] = True
    return matrix


@quick
@given(matrices, st.data())
def test_rows_are_the_dense_rows(matrix: np.ndarray, data: st.DataObject) -> None:
    rows = Rows.from_dense(matrix)
    assert (rows.n, rows.K) == matrix.shape
    np.testing.assert_array_equal(rows.dense(), matrix)
    ids = np.array(data.draw(st.lists(st.integers(0, len(matrix) - 1)) if len(matrix) else st.just([])), np.intp)
    np.testing.assert_array_equal(rows.select(ids).dense(), matrix[ids])
    start = data.draw(st.integers(0, len(matrix)))
    stop = data.draw(st.integers(start, len(matrix)))
    np.testing.assert_array_equal(rows.between(start, stop).dense(), matrix[start:stop])


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5])
def test_rows_are_selected_alike_whether_they_are_long_or_short(share: float) -> None:
    """Of 400 places at a half of which a row is true, and at a fiftieth; some rows twice, and empty ones."""
    rng = np.random.default_rng(3)
    matrix = rng.random((30, 400)) < share * (np.arange(30) % 5 > 0)[:, None]
    ids = rng.integers(0, 30, 50)
    chosen = Rows.from_dense(matrix).select(ids)
    assert (len(chosen.places) > LONG * len(ids)) == (share == 0.5)
    np.testing.assert_array_equal(chosen.dense(), matrix[ids])


@quick
@given(matrices, st.integers(1, 12))
def test_pieces_are_the_rows_bunch_by_bunch(matrix: np.ndarray, most: int) -> None:
    rows = Rows.from_dense(matrix)
    pieces = list(rows.pieces(most))
    assert sum(piece.n for piece in pieces) == rows.n
    assert all(piece.n == 1 or len(piece.places) <= most for piece in pieces)
    if pieces:
        np.testing.assert_array_equal(np.concatenate([piece.dense() for piece in pieces]), matrix)


@quick
@given(matrices)
def test_distinct_columns_are_the_columns_merged(matrix: np.ndarray) -> None:
    columns = distinct_columns(Rows.from_dense(matrix))
    np.testing.assert_array_equal(columns.views[columns.group], matrix.T)
    assert matrix.shape[1] == columns.K
    # Distinct, in the order of their bits, and each counted.
    lines = [tuple(view) for view in columns.views]
    assert lines == sorted({tuple(column) for column in matrix.T.astype(float)})
    assert list(columns.multiplicity) == [(view == matrix.T).all(axis=1).sum() for view in columns.views]


@quick
@given(matrices, st.integers(1, 5), st.booleans())
def test_a_factor_multiplies_like_the_views(matrix: np.ndarray, width: int, large: bool) -> None:
    columns = distinct_columns(Rows.from_dense(matrix))
    other = np.random.default_rng(0).random((len(matrix), width))
    product = columns.factor(10**9 if large else width) @ other
    np.testing.assert_allclose(product, columns.views @ other, rtol=1e-12)
