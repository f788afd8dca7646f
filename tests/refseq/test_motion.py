import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.motion import MotionSettings, MotionWindow, motion_prior
from tests.refseq.chains import dense_window, log, paths

quick = settings(deadline=None, max_examples=150, derandomize=True)
DEFAULTS = MotionSettings()
distances = st.integers(-40, 40).map(lambda eighths: eighths / 8)
motion_settings = st.sampled_from([DEFAULTS, MotionSettings(0.25, 0.0, 0.5), MotionSettings(1.0, 0.5, 0.01)])


def beliefs(data: st.DataObject, K: int) -> np.ndarray:
    weights = np.array(data.draw(st.lists(st.floats(0, 1), min_size=K, max_size=K))) + 1e-3
    return weights / weights.sum()


@quick
@given(paths(10), distances, motion_settings, st.data())
def test_shift_is_the_dense_window(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    dense, window = dense_window(along, distance, s), MotionWindow(along, distance, s)
    belief = beliefs(data, len(along))
    np.testing.assert_allclose(window.shift(belief), belief @ dense, atol=1e-12)
    np.testing.assert_allclose(window.pull(belief), dense @ belief, atol=1e-12)
    np.testing.assert_allclose(window.surprise(belief), belief @ -(dense * log(np.where(dense, dense, 1))), atol=1e-12)
    for j, row in enumerate(dense):
        one = window.shift(np.eye(len(along))[j])
        np.testing.assert_allclose(one, row, atol=1e-12)
        assert one.sum() == pytest.approx(1.0)  # no row is empty


@quick
@given(paths(10), distances, motion_settings, st.data())
def test_best_is_the_dense_maximum(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    K = len(along)
    value = st.one_of(st.floats(-9, 0), st.just(-np.inf))
    score = np.array(data.draw(st.lists(value, min_size=K, max_size=K)))
    dense, window = log(dense_window(along, distance, s)), MotionWindow(along, distance, s)
    np.testing.assert_allclose(window.best(score), (score[:, None] + dense).max(axis=0), atol=1e-12)
    for k in range(K):
        column = np.full(K, -np.inf)
        reach, column[reach] = window.into(k)[0], window.into(k)[1]
        np.testing.assert_allclose(column, dense[:, k], atol=1e-12)


def test_improbable_places_keep_their_digits() -> None:
    """A filter's probabilities span hundreds of orders of magnitude; what is small must not drown in rounding."""
    along = np.arange(60) * 0.4
    belief = 10.0 ** (-5.0 * np.arange(60))
    window = MotionWindow(along, 1.0, DEFAULTS)
    np.testing.assert_allclose(window.shift(belief), belief @ dense_window(along, 1.0, DEFAULTS), rtol=1e-12)


@quick
@given(paths(10), distances, motion_settings, st.data())
def test_prior_is_the_regularised_shift(
    along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject
) -> None:
    belief, K = beliefs(data, len(along)), len(along)
    prior = motion_prior(belief, along, distance, s)
    assert prior.sum() == pytest.approx(1.0)
    moved = s.regularisation * belief @ dense_window(along, distance, s)
    np.testing.assert_allclose(prior, moved + (1 - moved.sum()) / K, atol=1e-12)
    assert prior.min() >= (1 - s.regularisation) / K - 1e-12


def test_a_metre_from_the_fourth_place() -> None:
    """By hand: places a metre apart, d = 1 m: wide ±0.7 m holds place 4 alone, thin ±1.7 m places 3 and 5 too."""
    row = MotionWindow(np.arange(9.0), 1.0, DEFAULTS).shift(np.eye(9)[3])
    expected = np.zeros(9)
    expected[3:6] = np.array([0.1, 1.0, 0.1]) / 1.2
    np.testing.assert_allclose(row, expected, atol=1e-12)


def test_a_finer_grid_has_the_same_window_in_metres() -> None:
    """Five states a metre instead of one: the same shares within the same edges."""
    fine = np.arange(0, 20, 0.2)
    row = MotionWindow(fine, 2.0, DEFAULTS).shift(np.eye(100)[40])  # from 8 m to 10 m
    off = np.abs(fine - 10)
    np.testing.assert_array_equal(row > 0, off <= 0.9 + 2.0 + 1e-9)
    np.testing.assert_allclose(row[off <= 0.9 + 1e-9], row.max())
    np.testing.assert_allclose(row[(off > 0.9 + 1e-9) & (row > 0)], 0.1 * row.max())


def test_reversing_goes_back() -> None:
    along = np.arange(9.0)
    forward = MotionWindow(along, 2.0, DEFAULTS).shift(np.eye(9)[4])
    back = MotionWindow(along, -2.0, DEFAULTS).shift(np.eye(9)[4])
    np.testing.assert_allclose(back, forward[::-1], atol=1e-12)
    assert np.argmax(forward) > 4 > np.argmax(back)


def test_the_window_widens_with_the_distance() -> None:
    along = np.arange(0, 100, 0.5)
    spread = [np.count_nonzero(MotionWindow(along, d, DEFAULTS).shift(np.eye(200)[20])) for d in (0.5, 2.0, 8.0)]
    assert spread == sorted(set(spread))
