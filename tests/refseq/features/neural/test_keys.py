import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import map_coordinates

from refseq.features.neural.keys import REACH, SCALE, as_bytes, peaks, sampled

SCORES = hnp.arrays(
    np.float32, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.sampled_from([0, 1, 2, 3])
)


@given(SCORES, st.sampled_from([0.0, 1.5]), st.integers(1, 200))
def test_peaks_are_the_best_of_their_neighbourhood(score: np.ndarray, floor: float, cap: int) -> None:
    """Against every pixel looked at on its own."""
    found = []
    for y, x in np.ndindex(score.shape):
        around = score[max(0, y - REACH) : y + REACH + 1, max(0, x - REACH) : x + REACH + 1]
        if score[y, x] == around.max() and score[y, x] > floor:
            found.append((-score[y, x], y, x))
    expected = [(x, y) for _, y, x in sorted(found)[:cap]]
    assert list(map(tuple, peaks(score, floor, cap).tolist())) == expected


def test_descriptors_are_sampled_between_cells() -> None:
    """Against SciPy's bilinear interpolation, cells at the middle of their squares of pixels."""
    rng = np.random.default_rng(0)
    cells = rng.normal(size=(5, 6, 8)).astype(np.float32)
    size, at = (64, 48), rng.integers(0, (64, 48), (40, 2))
    rows, columns = (at[:, 1] + 0.5) / 8 - 0.5, (at[:, 0] + 0.5) / 8 - 0.5
    raw = np.array([map_coordinates(one, [rows, columns], order=1, mode="nearest") for one in cells]).T
    expected = raw / np.linalg.norm(raw, axis=1, keepdims=True)
    np.testing.assert_allclose(sampled(cells, at, size), expected, atol=1e-5)


def test_a_map_that_is_zero_somewhere_gives_no_nan() -> None:
    assert (sampled(np.zeros((3, 2, 2), np.float32), np.array([[0, 0]]), (16, 16)) == 0).all()
    assert sampled(np.ones((3, 2, 2), np.float32), np.zeros((0, 2), np.intp), (16, 16)).shape == (0, 3)


@pytest.mark.parametrize("depth", [64, 256])
def test_bytes_keep_distances(depth: int) -> None:
    """To the rounding of each value, half a step: whether two are one word is decided by these."""
    rng = np.random.default_rng(depth)
    units = rng.normal(size=(2, 200, depth))
    units = (units / np.linalg.norm(units, axis=2, keepdims=True)).astype(np.float32)
    true = SCALE * np.linalg.norm(units[0] - units[1], axis=1)
    kept = np.linalg.norm(as_bytes(units[0]).astype(float) - as_bytes(units[1]).astype(float), axis=1)
    assert np.abs(kept - true).max() <= np.sqrt(depth)
