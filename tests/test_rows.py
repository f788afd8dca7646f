import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from refseq_bench.rows import distinct_rows


@given(arrays(np.float64, array_shapes(min_dims=2, max_dims=2, max_side=9), elements=st.sampled_from([-1.5, 0.0, 2.0])))
def test_rows_are_those_of_numpy_in_its_order(rows: np.ndarray) -> None:
    found = distinct_rows(rows)
    _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    assert found[0].tolist() == first.tolist()
    assert found[1].tolist() == which.tolist()


def test_of_no_rows_none_is_distinct() -> None:
    assert [part.tolist() for part in distinct_rows(np.zeros((0, 3)))] == [[], []]
