import operator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad
from scipy.special import logsumexp

from refseq.inference.matching.columns import Rows
from refseq.inference.matching.detection import Detection
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.log_ratio import (
    Calibration,
    LogRatioModel,
    LogRatioSettings,
    PValues,
    log_calibrated,
    log_mean_calibrated,
    power_of,
    unless_blind,
    with_more,
)
from refseq.inference.matching.neighbours import REACH
from refseq.view import LASER

quick = settings(derandomize=True)

# --- the calibrator ---


def test_the_calibrator_averages_one() -> None:
    """∫ f(p) dp = 1 makes it one; by x = ln p, for its mass near p = 0 is spread as 1 / ln² p."""
    area, _ = quad(lambda x: np.exp(log_calibrated(np.exp(x)) + x), -600, 0, points=[-50, -5], limit=500)
    assert area + 1 / 600 == pytest.approx(1, abs=1e-3)  # below e^−600 it is 1 / (p ln² p), with the integral −1 / ln p


def test_the_calibrator_is_the_mean_of_the_power_calibrators() -> None:
    for p in (1e-6, 0.003, 0.2, 0.5, 0.9):
        mean, _ = quad(lambda kappa, p=p: kappa * p ** (kappa - 1), 0, 1)
        assert np.exp(log_calibrated(np.array(p))) == pytest.approx(mean, rel=1e-6)


def test_the_calibrator_falls_to_a_half() -> None:
    p = np.unique(np.concatenate([np.geomspace(1e-300, 1, 5000), np.linspace(0.9, 1, 5000)]))
    log_evidence = log_calibrated(p)
    assert np.isfinite(log_evidence).all()
    # Near 1 it is (1 − p)² / 2 over itself: rounding shows in the eighth digit.
    assert (np.diff(log_evidence) < 1e-7).all()
    assert np.exp(log_evidence[-1]) == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize("n", [0, 1, 10, 1000, 10**6])
def test_the_highest_score_of_all_brings_finite_evidence(n: int) -> None:
    best, worst = log_calibrated(np.array([1 / (n + 1), 1.0]))
    assert np.isfinite([best, worst]).all()
    assert best >= worst
    assert best <= np.log(n + 1)  # no calibrator with 1 / p everywhere averages 1


# --- p-values ---


@quick
@given(arrays(np.int8, st.integers(0, 20)), arrays(np.int8, st.integers(1, 9)))
def test_p_values_are_shares_of_scores_as_high(elsewhere: np.ndarray, scores: np.ndarray) -> None:
    found = Calibration(elsewhere.astype(float)).p_values(scores.astype(float))
    expected = [(1 + sum(other >= score for other in elsewhere)) / (1 + len(elsewhere)) for score in scores]
    np.testing.assert_allclose(found.high, expected)
    alone = ~np.isin(scores, elsewhere) & (len(elsewhere) > 0)
    np.testing.assert_array_equal(found.low[alone], found.high[alone])
    assert (found.low >= 0).all()
    assert (found.low[~alone] < found.high[~alone]).all()


@quick
@given(arrays(np.int8, st.integers(0, 20)), arrays(np.int8, st.integers(0, 9)))
def test_ratios_are_those_of_the_p_values_to_the_last_bit(elsewhere: np.ndarray, scores: np.ndarray) -> None:
    found, n = Calibration(elsewhere.astype(float)), len(elsewhere)
    as_high, higher = (np.array([sum(of(other, one) for other in elsewhere.tolist()) for one in scores.tolist()], int)
                       for of in (operator.ge, operator.gt))  # fmt: skip
    tied = (as_high - higher) / n if n else np.ones(len(scores))
    p = PValues((higher + 1 - tied) / (n + 1), (as_high + 1) / (n + 1))
    np.testing.assert_array_equal(found.log_ratios(scores.astype(float)), log_mean_calibrated(p))


@quick
@given(st.lists(st.integers(0, 6), min_size=2, max_size=15))
def test_p_values_are_valid_whatever_the_scores(scores: list[int]) -> None:
    """Of exchangeable scores, each may be the one looked at: p ≤ a in no more than a share a of the cases."""
    p = np.array([calibrated.p_values(score).high[0] for calibrated, score in each_against_the_others(scores)])
    for a in np.unique(p):
        assert (p <= a).mean() <= a + 1e-12


@quick
@given(st.lists(st.integers(0, 6), min_size=1, max_size=15))
def test_ratios_average_no_more_than_one_whatever_ties(scores: list[int]) -> None:
    """The promise of an e-value, exactly: over all ways to say which of exchangeable scores is the one looked at."""
    ratios = [np.exp(calibrated.log_ratios(score)[0]) for calibrated, score in each_against_the_others(scores)]
    assert np.mean(ratios) <= 1 + 1e-9
    if len(set(scores)) == 1:
        assert ratios == [1.0] * len(scores)  # they know nothing, and say nothing


def each_against_the_others(scores: list[int]) -> list[tuple[Calibration, np.ndarray]]:
    values = np.array(scores, float)
    return [(Calibration(np.delete(values, i)), values[i : i + 1]) for i in range(len(values))]


@quick
@given(st.sets(st.floats(-50, 50), min_size=2, max_size=15))
def test_scores_without_ties_are_calibrated_by_their_rank(scores: set[float]) -> None:
    values = np.array(sorted(scores))
    found = Calibration(values[1:]).log_ratios(values[:1])
    np.testing.assert_array_equal(found, log_calibrated(np.array([1.0])))
    found = Calibration(values[:-1]).log_ratios(values[-1:])
    np.testing.assert_array_equal(found, log_calibrated(np.array([1 / len(values)])))


@pytest.mark.parametrize(("low", "high"), [(0.0, 1e-3), (0.0, 1.0), (1e-5, 2e-5), (0.2, 0.9), (0.999, 1.0)])
def test_a_tie_brings_the_mean_over_what_it_spans(low: float, high: float) -> None:
    mean, _ = quad(lambda x: np.exp(log_calibrated(np.exp(x)) + x), np.log(low) if low else -600, np.log(high))
    mean += 0 if low else 1 / 600  # below e^−600 it is 1 / (p ln² p)
    found = log_mean_calibrated(PValues(np.array([low]), np.array([high])))
    assert np.exp(found[0]) == pytest.approx(mean / (high - low), rel=1e-3)


def test_ties_span_their_ranks() -> None:
    calibration = Calibration(np.array([1.0, 2.0, 2.0, 2.0]))
    found = calibration.p_values(np.array([2.0, 2.0 + 1e-9, 0.0]))
    np.testing.assert_allclose(found.high, [4 / 5, 1 / 5, 1])
    np.testing.assert_allclose(found.low, [(1 - 3 / 4) / 5, 1 / 5, 1])


@pytest.mark.quick_cases("1")
@pytest.mark.parametrize("decimals", [0, 1, 9])
def test_evidence_of_fresh_scores_averages_no_more_than_one(decimals: int) -> None:
    """Heavy tails in the scores, ties or none: what is not the place brings evidence 1 in the mean, or less."""
    rng = np.random.default_rng(decimals)
    draws = np.round(rng.standard_t(2, (3000, 101)), decimals)
    evidence = np.array([np.exp(Calibration(draw[1:]).log_ratios(draw[:1])[0]) for draw in draws])
    assert evidence.mean() <= 1 + 3 * evidence.std() / np.sqrt(len(evidence))
    # And not much less, or it would be wasted.
    assert evidence.mean() > 0.6
    assert (evidence > 5).mean() < 1 / 5


# --- beyond the highest ---


@quick
@given(arrays(np.int8, st.integers(0, 80)), st.floats(0.1, 5.0))
def test_scores_that_are_not_beyond_all_others_are_read_as_without_a_tail(elsewhere: np.ndarray, tail: float) -> None:
    values = elsewhere.astype(float)
    scores = np.unique(values)
    found, plain = Calibration(values, tail=tail), Calibration(values)
    np.testing.assert_array_equal(found.log_ratios(scores), plain.log_ratios(scores))


def test_beyond_the_highest_p_values_fall_by_how_the_highest_tenth_thins_out() -> None:
    """Of 100 scores the ten highest lie 0 to 9 above their least, 5 in the mean of the other nine."""
    elsewhere = np.arange(100.0)
    found = Calibration(elsewhere, tail=2.0).log_ratios(np.array([99.0 + 10.0, 99.0 + 20.0]))
    np.testing.assert_allclose(found, log_calibrated(np.exp([-1.0, -2.0]) / 101))


@quick
@given(st.lists(st.floats(-50, 50), min_size=50, max_size=80), st.floats(0.0, 1e3), st.floats(0.0, 1e3))
def test_farther_beyond_tells_more_but_no_more_than_as_many_scores_again_could(
    elsewhere: list[float], excess: float, more: float
) -> None:
    values = np.array(elsewhere)
    found = Calibration(values, tail=2.0).log_ratios(values.max() + np.array([0.0, excess, excess + more]))
    assert (np.diff(found) >= 0).all()
    assert found[-1] <= log_calibrated(np.array([(1 / (len(values) + 1)) ** 2]))[0] + 1e-9


@pytest.mark.parametrize("elsewhere", [np.zeros(0), np.arange(49.0), np.repeat([0.0, 1.0], 100)])
def test_where_it_is_not_known_how_scores_thin_out_none_tells_more_than_the_next(elsewhere: np.ndarray) -> None:
    """None at all, too few of them, and highest ones that are all the same."""
    scores = np.array([1e3, 1e6])
    found, plain = Calibration(elsewhere, tail=2.0), Calibration(elsewhere)
    np.testing.assert_array_equal(found.log_ratios(scores), plain.log_ratios(scores))


@pytest.mark.quick_cases("exponential")
@pytest.mark.parametrize("law", ["exponential", "normal", "laplace"])
def test_with_a_tail_fresh_scores_average_no_more_than_one(law: str) -> None:
    """The promise, for scores that thin out as fast as an exponential law or faster."""
    rng = np.random.default_rng(3)
    draws = getattr(rng, law)(size=(20_000, 101))
    evidence = np.array([np.exp(Calibration(draw[1:], tail=2.0).log_ratios(draw[:1])[0]) for draw in draws])
    assert evidence.mean() <= 1 + 3 * evidence.std() / np.sqrt(len(evidence))
    assert evidence.mean() > 0.6


# --- blocks ---

K, EACH = 60, 80


def drive(seed: int, period: int = 0) -> np.ndarray:
    """Features (K, EACH) that last a few places; of a drive that looks the same after every ``period`` places."""
    rng = np.random.default_rng(seed)
    since = np.arange(K)[:, None] % (period or K) - rng.uniform(-4, period or K, EACH)
    return (since >= 0) & (since < rng.uniform(2, 6, EACH))


def matrix_of(*blocks: np.ndarray) -> IncidenceMatrix:
    columns = [{f"b{i}": np.flatnonzero(seen[k]) for i, seen in enumerate(blocks)} for k in range(len(blocks[0]))]
    return IncidenceMatrix.from_columns(columns, {f"b{i}": seen.shape[1] for i, seen in enumerate(blocks)})


def model_of(*blocks: np.ndarray, spacing: float = 1.0, **changed: float) -> LogRatioModel:
    return LogRatioModel(matrix_of(*blocks), spacing * np.arange(len(blocks[0])), LogRatioSettings(**changed))


def shown(*rows: np.ndarray) -> dict[str, np.ndarray]:
    return {f"b{i}": np.flatnonzero(row) for i, row in enumerate(rows)}


def test_evidence_is_the_sum_over_blocks_and_nothing_from_those_not_observed() -> None:
    """To the power of these blocks together, 1 where they err apart from each other."""
    first, second = drive(1), drive(2)
    both, *alone = (model_of(*seen, blind=0.0) for seen in ((first, second), (first,), (second,)))
    a, b = shown(first[20], second[20]).values()
    np.testing.assert_array_equal(both.log_ratios({"b0": a}), alone[0].log_ratios({"b0": a}))
    np.testing.assert_array_equal(both.log_ratios({"b1": b}), alone[1].log_ratios({"b0": b}))
    summed = both.log_ratios({"b0": a}) + both.log_ratios({"b1": b})
    np.testing.assert_allclose(both.log_ratios({"b0": a, "b1": b}), both.power(["b0", "b1"]) * summed)
    assert both.power(["b0"]) == both.power(["b1"]) == 1
    np.testing.assert_array_equal(both.log_ratios({}), np.zeros(K))


@pytest.mark.parametrize("copies", [2, 4])
def test_blocks_that_err_together_count_less(copies: int) -> None:
    """A drive with doubles, and a block that says the same again: it adds no evidence that is not there."""
    seen = drive(5, period=20)
    model = model_of(*[seen] * copies, blind=0.0)
    power = model.power([f"b{i}" for i in range(copies)])
    assert 0 < power < 1
    far = [np.abs(np.arange(K) - k) > REACH for k in range(K)]
    found = [model.log_ratios(shown(*[seen[k]] * copies))[far[k]] for k in range(0, K, 3)]
    assert np.exp(np.concatenate(found)).mean() < 1.2
    assert np.exp(np.concatenate(found) / power).mean() > 1.3


@quick
@given(arrays(np.float64, st.integers(1, 30), elements=st.floats(-30, 30)))
def test_the_power_is_the_largest_that_keeps_the_mean_at_one(log_ratios: np.ndarray) -> None:
    power = power_of(log_ratios)
    assert 0 <= power <= 1
    assert logsumexp(power * log_ratios) - np.log(len(log_ratios)) <= 1e-4
    if 0 < power < 1:
        more = min(1.0, power + 1e-3)
        assert logsumexp(more * log_ratios) - np.log(len(log_ratios)) > 0


@pytest.mark.quick_cases("4.0-0.25")
@pytest.mark.parametrize(("apart", "spacing"), [(4.0, 1.0), (9.5, 1.0), (4.0, 0.25), (0.0, 5.0)])
def test_scores_are_read_against_those_of_views_far_from_their_places(apart: float, spacing: float) -> None:
    """From each view held out, at every place more than ``apart`` metres and ``REACH`` places away."""
    seen = drive(3)
    seen[31] = False  # a view that shows nothing tells nothing
    model = Detection(Rows.from_dense(seen.T))
    elsewhere = [
        model.log_ratios(np.flatnonzero(seen[k]), held_out=True)[m]
        for k in range(K)
        for m in range(K)
        if abs(k - m) * spacing > apart and abs(k - m) > REACH and seen[k].any()
    ]
    query = np.flatnonzero(drive(3)[12])
    expected = Calibration(np.array(elsewhere)).log_ratios(model.log_ratios(query))
    found = model_of(seen, spacing=spacing, apart=apart, blind=0.0).log_ratios({"b0": query})
    np.testing.assert_allclose(found, expected, atol=0.02)  # rounding may change ranks by one


@pytest.mark.parametrize("blind", [0.01, 0.2, 0.9])
def test_a_view_may_be_blind(blind: float) -> None:
    """With that chance it is as likely anywhere: the ratio of place to elsewhere is the mean of 1 and the evidence."""
    first, second = drive(1), drive(2)
    seeing, mixed = model_of(first, second, blind=0.0), model_of(first, second, blind=blind)
    for observed in (shown(first[20], second[20]), shown(first[5], second[50]), {}):
        evidence = np.exp(mixed.log_ratios(observed))
        np.testing.assert_allclose(evidence, blind + (1 - blind) * np.exp(seeing.log_ratios(observed)))


told = st.lists(st.tuples(st.floats(-8, 8), st.floats(-8, 8)), min_size=1, max_size=6)


@quick
@given(told, st.sampled_from([0.0, 0.01, 0.2, 0.9]))
def test_a_view_that_tells_more_is_blind_once(pairs: list[tuple[float, float]], blind: float) -> None:
    """Whatever hides its words hides the rest as well: words and more are one product, mixed with 1 once."""
    words, more = np.array(pairs).T
    both = with_more(unless_blind(words, blind), more, blind)
    np.testing.assert_allclose(both, unless_blind(words + more, blind), atol=1e-6)
    low = np.log(blind) - 1.0 if blind else -9.0
    assert (with_more(np.full(len(more), low), -np.abs(more), blind) <= low).all(), (
        "more against it never helps a place"
    )


@pytest.mark.parametrize(
    ("caps", "views", "scores"), [({}, K, K * K), ({"views": 25}, 25, K * K), ({"scores": 900}, K, 900)]
)
def test_views_and_scores_are_no_more_than_is_asked_for(
    caps: dict[str, float], views: int, scores: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    plain = Detection.log_ratios

    def noted(*given: object, **named: object) -> np.ndarray:
        found.append(plain(*given, **named))
        return found[-1]

    monkeypatch.setattr(Detection, "log_ratios", noted)
    model_of(drive(4), **caps)
    assert len(found) == views
    assert 0.5 * min(scores, views * K) < sum(map(len, found)) <= scores


def test_fewer_views_and_scores_give_much_the_same() -> None:
    seen = drive(4)
    query = shown(seen[33])
    whole = model_of(seen).log_ratios(query)
    for sample in (model_of(seen, views=25), model_of(seen, scores=900)):
        found = sample.log_ratios(query)
        assert np.corrcoef(found, whole)[0, 1] > 0.95
        assert np.argmax(found) in range(31, 36)


def test_a_block_that_repeats_brings_less_evidence_than_one_that_does_not() -> None:
    """Seen again every 12 places, a feature's place is one of five: the reference itself has shown it."""
    once, again = drive(5), drive(5, period=12)
    model = model_of(once, again)
    own, aliased = (
        np.mean([model.log_ratios({key: np.flatnonzero(seen[k])})[k] for k in range(5, 55)])
        for key, seen in (("b0", once), ("b1", again))
    )
    assert own > aliased + 1
    # At a place where it misleads, it must not speak louder than the share of such places allows.
    assert aliased < np.log(K / 4)


@pytest.mark.parametrize("places", [1, 2, 3, 4, 5, 8])
def test_maps_too_short_to_know_places_elsewhere_give_finite_evidence(places: int) -> None:
    seen = np.eye(places, dtype=bool).repeat(3, axis=1)
    model = model_of(seen)
    for row in (*seen, np.zeros(3 * places, bool), np.ones(3 * places, bool)):
        found = model.log_ratios(shown(row))
        assert found.shape == (places,)
        assert np.isfinite(found).all()


@pytest.mark.parametrize("seen", [np.zeros((K, 5), bool), np.ones((K, 5), bool), np.zeros((K, 0), bool)])
def test_a_block_that_is_the_same_everywhere_says_nothing(seen: np.ndarray) -> None:
    np.testing.assert_array_equal(model_of(seen).log_ratios(shown(seen[0])), np.zeros(K))
    telling = drive(8)
    both, alone = model_of(telling, seen), model_of(telling)
    row = shown(telling[11], seen[11])
    np.testing.assert_array_equal(both.log_ratios(row), alone.log_ratios({"b0": row["b0"]}))


def test_a_block_that_hardly_any_place_shows_says_hardly_anything_of_the_others() -> None:
    """As doors, in a corridor with a single one: not to see it must not speak against all places without it."""
    door = np.zeros((K, 1), bool)
    door[30] = True
    found = model_of(door, blind=0.0).log_ratios(shown(door[0]))
    assert (np.abs(np.delete(found, range(26, 35))) < 0.25).all()
    assert found[30] <= found.min() + 1e-9


def test_a_view_that_shows_nothing_is_answered() -> None:
    found = model_of(drive(6)).log_ratios({"b0": np.zeros(0, np.intp)})
    assert np.isfinite(found).all()
    assert found.max() < 2


def test_the_same_map_and_view_give_the_same_bytes() -> None:
    seen = drive(7)
    query = shown(seen[9])
    first, second = (model_of(seen).log_ratios(query) for _ in range(2))
    assert first.tobytes() == second.tobytes()


def long_drive(seed: int, places: int) -> np.ndarray:
    """Features (places, EACH) that come and go everywhere alike: kept from view to view by 3 in 4, gone for long."""
    rng = np.random.default_rng(seed)
    seen = [rng.random(EACH) < 1 / 6]
    for _ in range(places - 1):
        seen.append(np.where(seen[-1], rng.random(EACH) < 3 / 4, rng.random(EACH) < 1 / 20))
    return np.array(seen)


def test_a_picture_s_words_tell_more_beyond_the_highest_elsewhere_and_a_laser_s_do_not() -> None:
    """The same sightings under either sensor's name, of views that are nearly those of the drive."""
    seen = drive(1)
    views = [np.flatnonzero(row & (np.random.default_rng(k).random(EACH) < 0.9)) for k, row in enumerate(seen)]

    def told(sensor: str, tail: float) -> np.ndarray:
        """Log ratio of each view at its place."""
        key = f"words/{sensor}"
        matrix = IncidenceMatrix.from_columns([{key: np.flatnonzero(row)} for row in seen], {key: EACH})
        model = LogRatioModel(matrix, np.arange(float(K)), LogRatioSettings(blind=0.0, tail=tail))
        return np.array([model.log_ratios({key: view})[k] for k, view in enumerate(views)])

    np.testing.assert_array_equal(told(LASER, 2.0), told(LASER, 0.0))
    np.testing.assert_array_equal(told(LASER, 0.0), told("front", 0.0))
    assert told("front", 2.0).mean() > told("front", 0.0).mean() + 1


def test_views_like_the_drive_s_but_of_elsewhere_bring_no_evidence_in_the_mean() -> None:
    """The map is a drive's first part, the views are of its last, where the same features come and go as before.

    How common they are is learnt of the first part, and a little wrong for the last: the mean is 1.15, not below 1.
    """
    of_elsewhere, of_its_own = [], []
    for seed in range(30):
        seen = long_drive(seed, 2 * K)
        model = model_of(seen[:K])
        of_elsewhere += [np.exp([model.log_ratios(shown(row)) for row in seen[K + 10 :: 8]])]
        of_its_own += [np.median([np.exp(model.log_ratios(shown(seen[k]))[k]) for k in range(K)])]
    assert 0.6 < np.mean(of_elsewhere) < 1.3
    for x in (2, 5, 10, 20):
        assert (np.array(of_elsewhere) > x).mean() < 1 / x
    assert np.mean(of_its_own) > 10
