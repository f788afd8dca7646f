import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.inference.chain.exponential_kernel import REACH, ExponentialKernel
from tests.refseq.chains import log, paths

quick = settings(derandomize=True)


def check(along: np.ndarray, near: float, x: np.ndarray) -> None:
    distance = np.abs(along[:, None] - along) / near
    ahead = np.triu(np.exp(-distance))  # i ≤ k, as (i, k)
    nearness = ExponentialKernel(along, near)
    np.testing.assert_allclose(nearness.before(x), x @ ahead, rtol=1e-12)
    np.testing.assert_allclose(nearness.after(x), ahead @ x, rtol=1e-12)
    np.testing.assert_allclose(nearness.around(x), x @ np.exp(-distance), rtol=1e-12)
    scale = 1e-13 * distance.max() * np.abs(x).max() * len(x)
    np.testing.assert_allclose(nearness.surprise_before(x), x @ (ahead * distance), rtol=1e-11, atol=scale)
    np.testing.assert_allclose(nearness.surprise_after(x), (ahead * distance) @ x, rtol=1e-11, atol=scale)
    one_way = np.where(np.triu(np.ones_like(distance)) > 0, -distance, -np.inf)
    np.testing.assert_allclose(nearness.best_before(log(x)), (log(x)[:, None] + one_way).max(axis=0), atol=1e-9)
    np.testing.assert_allclose(nearness.best_after(log(x)), (one_way + log(x)).max(axis=1), atol=1e-9)


@quick
@given(paths(12), st.sampled_from([0.01, 0.3, 10.0]), st.integers(0, 2**32))
def test_it_is_the_dense_kernel(along: np.ndarray, near: float, seed: int) -> None:
    """With the shortest range, gaps of a few places are longer than a segment."""
    check(along, near, np.random.default_rng(seed).random(len(along)) + 1e-3)


@pytest.mark.parametrize("near", [0.05, 0.5, 5.0])
def test_long_paths_take_several_segments(near: float) -> None:
    rng = np.random.default_rng(3)
    along = np.cumsum(rng.uniform(0, 1.5, 400))
    assert along[-1] / near > (REACH if near < 0.5 else 0)
    check(along, near, 10 ** rng.uniform(-100, 0, 400))
