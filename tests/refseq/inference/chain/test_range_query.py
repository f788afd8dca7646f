import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.inference.chain.range_query import RangeQuery

quick = settings(derandomize=True)


@st.composite
def stretches(draw: st.DrawFn) -> tuple[int, np.ndarray, np.ndarray]:
    """Any stretches of arrays of up to 40 elements, also empty ones and the whole."""
    K = draw(st.integers(1, 40))
    edges = st.tuples(st.integers(0, K), st.integers(0, K)).map(sorted)
    pairs = np.array(draw(st.lists(edges, min_size=1, max_size=12)), np.intp)
    return K, pairs[:, 0], pairs[:, 1]


@quick
@given(stretches(), st.integers(0, 2**32))
def test_sums_and_maxima_are_those_of_the_slices(case: tuple[int, np.ndarray, np.ndarray], seed: int) -> None:
    K, start, stop = case
    values = np.random.default_rng(seed).normal(size=K)
    found = RangeQuery(start, stop, K)
    slices = [values[a:b] for a, b in zip(start, stop, strict=True)]
    np.testing.assert_array_equal(found.maxima(values), [s.max(initial=-np.inf) for s in slices])
    np.testing.assert_allclose(found.sums(values), [s.sum() for s in slices], atol=1e-13)


def test_small_values_beside_large_ones_keep_their_digits() -> None:
    values = 10.0 ** -np.arange(0, 300, 20)
    start = np.arange(len(values))
    sums = RangeQuery(start, np.minimum(start + 7, len(values)), len(values)).sums(values)
    np.testing.assert_allclose(sums, [values[a : a + 7].sum() for a in start], rtol=1e-14)


def test_many_rows_of_stretches_at_once() -> None:
    start, stop = np.array([[0, 1], [2, 3]]), np.array([[3, 1], [4, 5]])
    found = RangeQuery(start, stop, 5)
    np.testing.assert_array_equal(found.sums(np.arange(5.0)), [[3, 0], [5, 7]])
    np.testing.assert_array_equal(found.maxima(np.arange(5.0)), [[2, -np.inf], [3, 4]])
