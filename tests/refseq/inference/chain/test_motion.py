import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from refseq.inference.chain.motion import MotionSettings, motion_model, motion_prior
from tests.refseq.chains import SPREAD, dense_window, log, paths

quick = settings(derandomize=True)
DEFAULTS = MotionSettings()
distances = st.integers(-40, 40).map(lambda eighths: eighths / 8)
motion_settings = st.sampled_from(
    [
        DEFAULTS,
        MotionSettings(0.25, 0.0, 0.5),
        MotionSettings(1.0, 0.5, 0.01),
        SPREAD,
        MotionSettings(0.0, 0.0, 0.3, interpolated=True),
        MotionSettings(1.0, 0.5, 0.0, interpolated=True),
    ]
)


def beliefs(data: st.DataObject, K: int) -> np.ndarray:
    weights = np.array(data.draw(st.lists(st.floats(0, 1), min_size=K, max_size=K))) + 1e-3
    return weights / weights.sum()


@quick
@given(paths(10), distances, motion_settings, st.data())
def test_shift_is_the_dense_window(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    dense, window = dense_window(along, distance, s), motion_model(along, distance, s)
    belief = beliefs(data, len(along))
    np.testing.assert_allclose(window.predict(belief), belief @ dense, atol=1e-12)
    np.testing.assert_allclose(window.backward(belief), dense @ belief, atol=1e-12)
    np.testing.assert_allclose(window.surprise(belief), belief @ -(dense * log(np.where(dense, dense, 1))), atol=1e-12)
    for j, row in enumerate(dense):
        one = window.predict(np.eye(len(along))[j])
        np.testing.assert_allclose(one, row, atol=1e-12)
        assert one.sum() == pytest.approx(1.0)  # no row is empty


@quick
@given(paths(10), distances, motion_settings, st.data())
def test_best_is_the_dense_maximum(along: np.ndarray, distance: float, s: MotionSettings, data: st.DataObject) -> None:
    K = len(along)
    value = st.one_of(st.floats(-9, 0), st.just(-np.inf))
    score = np.array(data.draw(st.lists(value, min_size=K, max_size=K)))
    dense, window = log(dense_window(along, distance, s)), motion_model(along, distance, s)
    np.testing.assert_allclose(window.best(score), (score[:, None] + dense).max(axis=0), atol=1e-12)
    for k in range(K):
        column = np.full(K, -np.inf)
        reach, column[reach] = window.predecessors(k)[0], window.predecessors(k)[1]
        np.testing.assert_allclose(column, dense[:, k], atol=1e-12)


def test_a_window_without_a_tail_and_without_a_place_stays_where_it_is() -> None:
    along = np.arange(5.0)
    window = motion_model(along, 0.3, MotionSettings(0.1, 0.0, 0.0))
    belief = np.array([0.1, 0.2, 0.3, 0.4, 0.0])
    np.testing.assert_allclose(window.predict(belief), belief)
    np.testing.assert_allclose(window.surprise(belief), 0.0, atol=1e-12)
    bridged = motion_model(along, 1.2, MotionSettings(0.1, 0.2, 0.0)).predict(np.eye(5)[0])
    np.testing.assert_allclose(bridged, np.eye(5)[1], atol=1e-8, err_msg="of a window with a place the tail is no part")


def test_improbable_places_keep_their_digits() -> None:
    """A filter's probabilities span hundreds of orders of magnitude; what is small must not drown in rounding."""
    along = np.arange(60) * 0.5
    belief = 10.0 ** (-5.0 * np.arange(60))
    for s in (DEFAULTS, SPREAD):
        window = motion_model(along, 1.0, s)
        np.testing.assert_allclose(window.predict(belief), belief @ dense_window(along, 1.0, s), rtol=1e-11)


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
    row = motion_model(np.arange(9.0), 1.0, DEFAULTS).predict(np.eye(9)[3])
    expected = np.zeros(9)
    expected[3:6] = np.array([0.1, 1.0, 0.1]) / 1.2
    np.testing.assert_allclose(row, expected, atol=1e-12)


def test_a_finer_grid_has_the_same_window_in_metres() -> None:
    """Five states a metre instead of one: the same shares within the same edges."""
    fine = np.arange(0, 20, 0.2)
    row = motion_model(fine, 2.0, DEFAULTS).predict(np.eye(100)[40])  # from 8 m to 10 m
    off = np.abs(fine - 10)
    np.testing.assert_array_equal(row > 0, off <= 0.9 + 2.0 + 1e-9)
    np.testing.assert_allclose(row[off <= 0.9 + 1e-9], row.max())
    np.testing.assert_allclose(row[(off > 0.9 + 1e-9) & (row > 0)], 0.1 * row.max())


def test_reversing_goes_back() -> None:
    along = np.arange(9.0)
    forward = motion_model(along, 2.0, DEFAULTS).predict(np.eye(9)[4])
    back = motion_model(along, -2.0, DEFAULTS).predict(np.eye(9)[4])
    np.testing.assert_allclose(back, forward[::-1], atol=1e-12)
    assert np.argmax(forward) > 4 > np.argmax(back)


def test_the_window_widens_with_the_distance() -> None:
    along = np.arange(0, 100, 0.5)
    spread = [np.count_nonzero(motion_model(along, d, DEFAULTS).predict(np.eye(200)[20])) for d in (0.5, 2.0, 8.0)]
    assert spread == sorted(set(spread))


@quick
@given(st.integers(0, 79), st.floats(-4, 4), st.lists(st.floats(0.05, 3), min_size=80, max_size=80))
def test_a_spread_window_moves_as_far_as_the_odometer(j: int, distance: float, gaps: list[float]) -> None:
    """The mean of what it gives is j's position + d, however the places lie, while none of it is past an end."""
    along = np.cumsum(gaps)
    reach = SPREAD.half_width(distance) + abs(distance)
    assume(along[0] < along[j] + distance - reach and along[j] + distance + reach < along[-1])
    row = motion_model(along, distance, SPREAD).predict(np.eye(80)[j])
    assert row @ along == pytest.approx(along[j] + distance)


def test_many_short_steps_are_one_long_one() -> None:
    """Views closer than the places must not leave the belief behind, as counting places does."""
    along, start = np.arange(60) * 0.86, np.eye(60)[10]
    moved = {}
    for s in (SPREAD, MotionSettings(0.1, 0.1, 0.02)):
        belief = start
        for _ in range(40):
            belief = motion_model(along, 0.3, s).predict(belief)
        moved[s.interpolated] = belief @ along - along[10]
    assert moved[True] == pytest.approx(12.0)
    assert moved[False] < 1.0


def test_paths_laid_behind_each_other_share_nothing() -> None:
    along = np.array([0.0, 1.0, 2.0, 1000.0, 1001.0])
    past_an_end = motion_model(along, 2.5, SPREAD, (2, 4)).predict(np.eye(5)[2])
    np.testing.assert_allclose(past_an_end, np.eye(5)[2], atol=5e-3)
    before_a_start = motion_model(along, -2.5, SPREAD, (2, 4)).predict(np.eye(5)[3])
    np.testing.assert_allclose(before_a_start, np.eye(5)[3], atol=5e-3)


@quick
@given(paths(10), motion_settings, st.data())
def test_an_unmeasured_motion_is_one_of_the_usual_step_with_as_much_slack_again(
    along: np.ndarray, settings: MotionSettings, data: st.DataObject
) -> None:
    belief = beliefs(data, len(along))
    driven = [gap for gap in np.diff(along) if gap > 0]
    step = float(np.median(driven)) if driven else 0.0
    wide = MotionSettings(
        settings.slack + step, settings.drift, settings.tail, settings.interpolated, settings.regularisation
    )
    expected = motion_prior(belief, along, step, wide)
    np.testing.assert_array_equal(motion_prior(belief, along, np.nan, settings), expected)
