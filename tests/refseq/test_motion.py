import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.motion import MotionSettings, MotionWindow, motion_prior

quick = settings(deadline=None, max_examples=150, derandomize=True)
DEFAULTS = MotionSettings()
# Eighths of a metre are exact, so that edges of windows are hit exactly.
paths = st.lists(st.integers(0, 24), min_size=0, max_size=9).map(lambda gaps: np.cumsum([0, *gaps]) / 8)
distances = st.integers(-40, 40).map(lambda eighths: eighths / 8)
motion_settings = st.sampled_from([DEFAULTS, MotionSettings(0.25, 0.0, 0.5), MotionSettings(1.0, 0.5, 0.01)])


def dense_window(along: np.ndarray, distance: float, s: MotionSettings) -> np.ndarray:
    """P(k | j, d) as (j, k), from Fig. 3.7 in words: 1 in the wide bar, ``thin`` in the bars beside it, else 0."""
    K = len(along)
    window = np.zeros((K, K))
    wide = s.slack + s.drift * abs(distance)
    for j in range(K):
        for k in range(K):
            off = abs(along[k] - (along[j] + distance))
            if off <= wide:
                window[j, k] = 1.0
            elif off <= wide + abs(distance):
                window[j, k] = s.thin
        window[j] /= window[j].sum()
    return window


def beliefs(data: st.DataObject, K: int) -> np.ndarray:
    weights = np.array(data.draw(st.lists(st.floats(0, 1), min_size=K, max_size=K))) + 1e-3
    return weights / weights.sum()


@quick
@given(paths, distances, motion_settings, st.data())
def test_shift_is_the_dense_window(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    dense, window = dense_window(along, distance, s), MotionWindow(along, distance, s)
    belief = beliefs(data, len(along))
    np.testing.assert_allclose(window.shift(belief), belief @ dense, atol=1e-12)
    for j, row in enumerate(dense):
        one = window.shift(np.eye(len(along))[j])
        np.testing.assert_allclose(one, row, atol=1e-12)
        assert one.sum() == pytest.approx(1.0)  # no row is empty


@quick
@given(paths, distances, motion_settings, st.data())
def test_best_is_the_dense_maximum(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    K = len(along)
    value = st.one_of(st.floats(-9, 0), st.just(-np.inf))
    score = np.array(data.draw(st.lists(value, min_size=K, max_size=K)))
    with np.errstate(divide="ignore"):
        ways = score[:, None] + np.log(dense_window(along, distance, s))
    best, source = MotionWindow(along, distance, s).best(score)
    np.testing.assert_allclose(best, ways.max(axis=0), atol=1e-12)
    reached = np.isfinite(best)
    np.testing.assert_allclose(ways[source, np.arange(K)][reached], best[reached], atol=1e-12)


@quick
@given(paths, distances, motion_settings, st.data())
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
