import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.inference.matching.columns import Rows
from refseq.inference.matching.detection import LEAST, PRIOR, RATES, Detection, covisibility, reach, spread
from refseq.inference.matching.neighbours import REACH, Neighbours

quick = settings(derandomize=True)
small_matrices = st.tuples(st.integers(0, 7), st.integers(1, 12)).flatmap(lambda shape: arrays(np.bool_, shape))


def model(seen: np.ndarray) -> Detection:
    return Detection(Rows.from_dense(seen))


def brute_force(seen: np.ndarray, shown: np.ndarray, fades: np.ndarray, counts: np.ndarray, total: int) -> list[float]:
    """Log P(view | place) / P(view | anywhere), each probability written out; the view shows the features ``shown``."""
    ratios = []
    for k in range(seen.shape[1]):
        by_rate = []
        for d in RATES:
            at_place, anywhere = 1.0, 1.0
            for i, places in enumerate(seen):
                away = min((abs(k - m) for m in np.flatnonzero(places)), default=math.inf)
                s = fades[int(away)] if away <= REACH and fades[int(away)] >= LEAST else 0.0
                f = (counts[i] + PRIOR) / (total + 2 * PRIOR)
                shows = f + d * s * (1 - f)
                at_place *= shows if shown[i] else 1 - shows
                anywhere *= f if shown[i] else 1 - f
            by_rate.append(at_place / anywhere)
        ratios.append(math.log(np.mean(by_rate)))
    return ratios


@quick
@given(small_matrices, st.data())
def test_ratios_are_those_of_the_model_written_out(seen: np.ndarray, data: st.DataObject) -> None:
    shown = data.draw(arrays(np.bool_, len(seen)))
    detection = model(seen)
    expected = brute_force(seen, shown, detection.covisibility, seen.sum(axis=1), seen.shape[1])
    np.testing.assert_allclose(detection.log_ratios(np.flatnonzero(shown)), expected, atol=1e-12)


def test_a_feature_of_one_place_in_four_by_hand() -> None:
    """It shows anywhere with 2/6 = 1/3, Laplace's rule, and is detected at its place in 5, 20, 50 or 90 of 100 views.

    A view that shows it is 1 + 2 d times as likely at its place as anywhere, and one that does not 1 - d times.
    """
    seen = model(np.array([[True, False, False, False]]))
    assert seen.log_ratios(np.array([0])) == pytest.approx([math.log(1.825), 0, 0, 0])
    assert seen.log_ratios(np.array([], int)) == pytest.approx([math.log(0.5875), 0, 0, 0])


# Long enough stretches for all levels, with gaps of all sizes between them.
STRETCHES = np.array(
    [[k in range(b, b + 5) or (b % 3 == 0 and (k - b) % (6 + b % 5) == 0) for k in range(40)] for b in range(-4, 40)]
    + [[False] * 40, [True] * 40, [k in (0, 39) for k in range(40)]]
)


@pytest.mark.parametrize("seed", range(5))
def test_ratios_of_stretches_that_spread_over_all_levels(seed: int) -> None:
    detection = model(STRETCHES)
    assert (detection.covisibility[1:] > 0.1).all()  # or no place beside would count
    shown = np.random.default_rng(seed).random(len(STRETCHES)) < 0.3
    expected = brute_force(STRETCHES, shown, detection.covisibility, STRETCHES.sum(axis=1), 40)
    np.testing.assert_allclose(detection.log_ratios(np.flatnonzero(shown)), expected, atol=1e-11)


@pytest.mark.parametrize("k", [0, 1, 17, 38, 39])
def test_a_view_held_out_is_judged_by_the_others(k: int) -> None:
    """Far from it the ratios are those of the drive without it: of 39 places, and with its column empty."""
    shown = STRETCHES[:, k]
    emptied = STRETCHES.copy()
    emptied[:, k] = False
    detection = model(STRETCHES)
    expected = brute_force(emptied, shown, detection.covisibility, emptied.sum(axis=1), 39)
    far = np.abs(np.arange(40) - k) > REACH
    held_out = detection.log_ratios(np.flatnonzero(shown), held_out=True)
    np.testing.assert_allclose(held_out[far], np.array(expected)[far], atol=1e-11)
    assert np.abs(held_out - detection.log_ratios(np.flatnonzero(shown)))[far].max() > 0.01


def test_a_rare_feature_speaks_for_its_place_more_than_a_common_one() -> None:
    K = 30
    seen = np.stack([np.arange(K) == 14, np.arange(K) % 3 == 0])
    rare, common = (model(seen).log_ratios(np.array([i])) for i in range(2))
    assert rare[14] > 2 * common[15] > 0
    assert np.argmax(rare) == 14


def test_the_order_of_features_says_nothing() -> None:
    detection = model(STRETCHES)
    ids = np.array([3, 11, 20, 44])
    np.testing.assert_allclose(detection.log_ratios(ids[::-1]), detection.log_ratios(ids), rtol=1e-12)


def test_no_features_at_all_tell_nothing() -> None:
    empty = np.zeros(0, np.intp)
    np.testing.assert_array_equal(model(np.zeros((0, 5), bool)).log_ratios(empty), np.zeros(5))
    np.testing.assert_array_equal(model(np.zeros((3, 5), bool)).log_ratios(empty), np.zeros(5))
    np.testing.assert_allclose(model(np.zeros((3, 5), bool)).log_ratios(np.array([1])), np.zeros(5), atol=1e-15)


# --- covisibility ---


def stretches(rng: np.random.Generator, places: int, K: int = 300, features: int = 2000) -> np.ndarray:
    """Features that are seen at ``places`` places in a row, begun anywhere, and so also cut by the drive's ends."""
    since = np.arange(K) - rng.integers(1 - places, K, (features, 1))
    return (since >= 0) & (since < places)


@quick
@given(small_matrices)
def test_fading_begins_with_one_and_falls(seen: np.ndarray) -> None:
    fades = covisibility(Rows.from_dense(seen))
    assert fades.shape == (REACH + 1,)
    assert fades[0] == 1
    assert (np.diff(fades) <= 0).all()
    assert fades[-1] >= 0


@pytest.mark.parametrize("places", [1, 2, 3, 4, 8, 20])
def test_fading_of_features_that_last_so_many_places(places: int) -> None:
    """Two views m apart share (n − m) / n of what lasts n places."""
    expected = np.clip(1 - np.arange(REACH + 1) / places, 0, 1)
    found = covisibility(Rows.from_dense(stretches(np.random.default_rng(places), places)))
    np.testing.assert_allclose(found, expected, atol=0.02)


@pytest.mark.parametrize("detected", [1.0, 0.6, 0.3])
@pytest.mark.parametrize("kept", [0.8, 0.5])
def test_fading_of_features_that_are_lost_by_a_factor(kept: float, detected: float) -> None:
    """How often a feature that is there is found has no part in it: only how long it is there."""
    rng = np.random.default_rng(int(100 * kept))
    lasts = rng.geometric(1 - kept, 30_000)
    since = np.arange(250) - rng.integers(-20, 250, (len(lasts), 1))
    seen = (since >= 0) & (since < lasts[:, None]) & (rng.random(since.shape) < detected)
    np.testing.assert_allclose(covisibility(Rows.from_dense(seen)), kept ** np.arange(REACH + 1), atol=0.03)


@pytest.mark.parametrize("common", [0.02, 0.2, 0.6])
def test_chance_alone_does_not_fade(common: float) -> None:
    """However common the features, neighbours share no more of them than others do."""
    drives = np.random.default_rng(8).random((40, 400, 60)) < common
    found = np.array([covisibility(Rows.from_dense(seen))[1:] for seen in drives])
    # Two standard errors are passed by chance in one case of forty.
    assert (found.max(axis=1) > 0).sum() <= 3


def test_common_features_do_not_hide_what_fades() -> None:
    """Chance is taken off: beside features that last 4 places others are seen anywhere, three times as often."""
    rng = np.random.default_rng(9)
    seen = stretches(rng, 4)
    found = covisibility(Rows.from_dense(np.concatenate([seen, rng.random(seen.shape) < 0.04])))
    # 3, 2 and 1 of 4 are shared, less by one factor; carried on as 3/2 from 2 and 3, the same place shares 4.5.
    np.testing.assert_allclose(found, [1, 3 / 4.5, 2 / 4.5, 1 / 4.5], atol=0.05)


@pytest.mark.parametrize("K", [6, 7, 8, 10, 14])
def test_in_a_short_drive_too_only_places_far_apart_show_what_chance_shares(K: int) -> None:
    """Half of the features last 3 places, others are seen at both ends: chance is counted by the pairs there are."""
    runs = [[b <= k < b + 3 for k in range(K)] for b in range(-2, K)]
    ends = [[k in (0, K - 1) for k in range(K)]] * 2
    found = covisibility(Rows.from_dense(np.array(runs + ends)))
    assert 0.3 < found[1] < 0.9
    assert found[2] < found[1]


@quick
@given(small_matrices, st.integers(1, REACH + 1))
def test_each_place_near_a_row_s_is_reached_once_by_the_nearest_entry(seen: np.ndarray, levels: int) -> None:
    rows = Rows.from_dense(seen)
    found = np.full(seen.shape, levels)
    for level, beside in spread(rows, reach(rows, levels, Neighbours.even(rows.K)), levels):
        at = beside.numbers(), beside.places
        assert (found[at] == levels).all()
        found[at] = level
    for row, places in zip(found, seen, strict=True):
        away = np.abs(np.arange(seen.shape[1])[:, None] - np.flatnonzero(places)[None])
        np.testing.assert_array_equal(row, np.minimum(away.min(axis=1, initial=levels), levels))


@given(st.integers(0, 2**31), st.integers(1, 40), st.booleans())
def test_ratios_of_some_places_are_those_of_all_to_the_last_bit(seed: int, count: int, held_out: bool) -> None:
    rng = np.random.default_rng(seed)
    found = model(stretches(rng, places=int(rng.integers(1, 12)), K=120, features=200))
    ids = np.flatnonzero(rng.random(200) < rng.choice([0.02, 0.3, 0.9]))
    places = rng.permutation(120)[:count]
    some, every = found.log_ratios(ids, held_out, places), found.log_ratios(ids, held_out)
    np.testing.assert_array_equal(some, every[places])


# --- gaps and stands ---


def test_nothing_reaches_over_a_gap() -> None:
    """Of 20 and 20 places 30 m apart each is reached by the nearest entry of its own stretch."""
    levels, rows = REACH + 1, Rows.from_dense(STRETCHES)
    neighbours = Neighbours.of(0.8 * np.r_[0:20, 60:80])
    found = np.full(STRETCHES.shape, levels)
    for level, beside in spread(rows, reach(rows, levels, neighbours), levels):
        found[beside.numbers(), beside.places] = level
    k = np.arange(40)
    for row, places in zip(found, STRETCHES, strict=True):
        at = np.flatnonzero(places)
        away = np.abs(k[:, None] - at) + levels * ((k[:, None] < 20) != (at < 20))
        np.testing.assert_array_equal(row, np.minimum(away.min(axis=1, initial=levels), levels))


def test_a_view_before_a_gap_says_nothing_for_the_place_behind_it() -> None:
    seen = stretches(np.random.default_rng(2), 4, K=60)[:, np.r_[0:20, 40:60]]  # the middle was given away
    along, view = np.r_[0:20, 40:60].astype(float), np.flatnonzero(seen[:, 19])
    ratios, by_number = (
        Detection(Rows.from_dense(seen), Neighbours.of(along)).log_ratios(view),
        model(seen).log_ratios(view),
    )
    assert by_number[20] > 50 > 0 > ratios[20]
    assert ratios[19] > 50


@pytest.mark.parametrize("gap_at", [1, 7, 19])
def test_pairs_over_a_gap_are_far_apart(gap_at: int) -> None:
    """Counted by hand over all pairs of places."""
    rng = np.random.default_rng(gap_at)
    since = np.arange(40) - rng.integers(-3, 40, (500, 1))
    seen = (since >= 0) & (since < 4)
    seen[:, gap_at:] = seen[:, gap_at:][:, ::-1]  # what lies behind the gap has nothing to do with what is before
    stretch = np.arange(40) >= gap_at
    along = np.arange(40) + 50.0 * stretch
    shared, chances = np.zeros(REACH + 1), np.zeros(REACH + 1)
    for j, k in ((j, k) for j in range(40) for k in range(40) if j != k):
        near = stretch[j] == stretch[k] and abs(j - k) <= REACH
        if near and k < j:
            continue
        slot = k - j - 1 if near else REACH
        shared[slot] += np.count_nonzero(seen[:, j] & seen[:, k])
        chances[slot] += np.count_nonzero(seen[:, j])
    *near_share, chance = shared / chances
    share = (np.array(near_share) - chance) / (1 - chance)
    same = min(1.0, max(share[0] ** 2 / share[1], share[0]))
    found = covisibility(Rows.from_dense(seen), Neighbours.of(along))
    np.testing.assert_allclose(found, np.minimum.accumulate(np.r_[1, np.clip(share / same, 0, 1)]), atol=1e-12)


@pytest.mark.parametrize("views", [1, 20, 300])
def test_a_stand_does_not_change_how_features_fade(views: int) -> None:
    """All views of a stand are of one place: their number tells nothing of what neighbours share."""
    seen = stretches(np.random.default_rng(5), 4)
    stood = np.insert(seen, np.full(views, 100), seen[:, 100:101], axis=1)
    along = np.insert(np.arange(300.0), np.full(views, 100), 100.0)
    found = covisibility(Rows.from_dense(stood), Neighbours.of(along))
    np.testing.assert_allclose(found, covisibility(Rows.from_dense(seen)), atol=1e-12)
