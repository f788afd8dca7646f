from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import logsumexp

from refseq.inference.matching.columns import Rows, distinct_columns
from refseq.inference.matching.hard_em import Seeding, seed_views
from refseq.inference.matching.mixture import Match, MixtureForm, MixtureSettings, match_view

quick = settings(derandomize=True)
matrices = st.tuples(st.integers(0, 10), st.integers(1, 14)).flatmap(lambda shape: arrays(np.bool_, shape))
mixture_settings = st.builds(
    MixtureSettings,
    cost=st.floats(0.8, 0.95),
    components=st.sampled_from([0.1, 0.5, 1.0]),
    from_views=st.sampled_from([0.0, 0.8, 1.0]),
    iterations=st.integers(1, 20),
)
any_form = st.builds(
    MixtureSettings,
    form=st.sampled_from(MixtureForm),
    visible=st.sampled_from([0.5, 0.7, 0.95]),
    invisible=st.sampled_from([0.5, 0.6]),
    limit=st.sampled_from([0.0, 0.1, 0.25]),
    components=st.sampled_from([0.1, 0.5, 1.0]),
    most=st.sampled_from([1, 3, 1000]),
    from_views=st.sampled_from([0.0, 0.8, 1.0]),
    seeds=st.sampled_from(Seeding),
    as_printed=st.booleans(),
    all_features=st.booleans(),
    iterations=st.integers(1, 40),
)
DEFAULTS = MixtureSettings()


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def unmerged(visible: np.ndarray, s: MixtureSettings, seed: int) -> tuple[np.ndarray, list[float]]:
    """Algorithm 1 view by view and feature by feature, nothing merged; the likelihood and the residuals.

    Views that share equally many features are taken by their bits, as bytes: the order of equals is free.
    """
    n, K = visible.shape
    uniform = np.full(K, 1 / K)
    if n == 0 or not visible.any():
        return uniform, []
    views = visible.T.astype(int)
    C = max(1, round(s.components * K))
    copies = min(round(s.from_views * C), K)
    order = sorted(range(K), key=lambda k: (-views[k].sum(), np.packbits(visible[:, k]).tobytes()))
    theta = [views[k].astype(float) for k in order[:copies]]
    theta += list(rng(seed).integers(0, 2, size=(C - copies, n)).astype(float))
    residuals: list[float] = []
    for _ in range(s.iterations):
        owner = [int(np.argmin([np.abs(view - t).sum() for t in theta])) for view in views]
        residuals.append(float(np.mean([np.abs(views[k] - theta[owner[k]]).mean() for k in range(K)])))
        if len(residuals) > 1 and abs(residuals[-2] - residuals[-1]) < s.tolerance:
            log_likelihood = np.log(s.cost) * np.array([n - theta[c].sum() for c in owner])
            return np.exp(log_likelihood - logsumexp(log_likelihood)), residuals
        for c in range(C):
            mine = [views[k] for k in range(K) if owner[k] == c]
            if mine:
                theta[c] = np.round(np.mean(mine, axis=0))
    return uniform, residuals


def assert_distribution(match: Match, K: int) -> None:
    assert match.likelihood.shape == (K,)
    assert (match.likelihood >= 0).all()
    assert match.likelihood.sum() == pytest.approx(1.0, abs=1e-12)


@quick
@given(matrices, mixture_settings, st.integers(0, 99))
def test_is_a_distribution_and_equals_the_unmerged_computation(
    visible: np.ndarray, s: MixtureSettings, seed: int
) -> None:
    match = match_view(visible, s, rng(seed))
    assert_distribution(match, visible.shape[1])
    expected, residuals = unmerged(visible, s, seed)
    np.testing.assert_allclose(match.likelihood, expected, rtol=1e-10)
    # EM comes down.
    assert (np.diff(residuals) <= 1e-12).all()
    if not match.failed:
        assert match.iterations == len(residuals)


def test_em_has_settled_when_the_share_of_features_that_differ_changes_little() -> None:
    """Of many features in many views: it ends at the same step as view by view."""
    visible = rng(1).random((40, 60)) < 0.3
    fine, coarse = (
        MixtureSettings(components=0.1, from_views=0.0, tolerance=tol, iterations=50) for tol in (1e-9, 0.0101)
    )
    for settings_, seed in ((fine, 1), (coarse, 1), (coarse, 2)):
        _, residuals = unmerged(visible, settings_, seed)
        assert match_view(visible, settings_, rng(seed)).iterations == len(residuals)
    assert len(unmerged(visible, coarse, 1)[1]) < len(unmerged(visible, fine, 1)[1])


@quick
@given(matrices, any_form, st.integers(0, 99), st.data())
def test_is_a_distribution_in_every_form_packed_or_not(
    matrix: np.ndarray, s: MixtureSettings, seed: int, data: st.DataObject
) -> None:
    n, K = matrix.shape
    observed = np.array(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), bool)
    match = match_view(matrix, s, rng(seed), observed)
    assert_distribution(match, K)
    packed = match_view(Rows.from_dense(matrix), s, rng(seed), observed)
    np.testing.assert_array_equal(match.likelihood, packed.likelihood)
    assert (match.failed, match.iterations) == (packed.failed, packed.iterations)
    if match.failed:
        np.testing.assert_array_equal(match.likelihood, np.full(K, 1 / K))


@quick
@given(matrices, st.floats(0.8, 0.95), st.data())
def test_counting_all_features_prices_those_that_only_the_place_has_as_well(
    matrix: np.ndarray, cost: float, data: st.DataObject
) -> None:
    n = len(matrix)
    observed = np.array(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), bool)
    match = match_view(matrix, MixtureSettings(MixtureForm.COUNTING, cost, all_features=True), rng(), observed)
    by_hand = np.array(
        [cost ** sum(one != other for one, other in zip(view, observed, strict=True)) for view in matrix.T]
    )
    expected = by_hand / by_hand.sum() if matrix.any() else np.full(matrix.shape[1], 1 / matrix.shape[1])
    np.testing.assert_allclose(match.likelihood, expected, rtol=1e-9)


@quick
@given(matrices.filter(lambda matrix: matrix.any()), st.integers(1, 14))
def test_varied_seeds_are_each_as_far_as_can_be_from_those_before(visible: np.ndarray, count: int) -> None:
    columns = distinct_columns(Rows.from_dense(visible))
    order = seed_views(columns, np.ones(len(visible), bool), count, Seeding.VARIETY)
    assert len(order) == min(count, visible.shape[1])
    apart = np.abs(columns.views[:, None] - columns.views[None]).sum(axis=2)
    taken = list(dict.fromkeys(order.tolist()))
    assert columns.views[taken[0]].sum() == columns.views.sum(axis=1).max()
    for number, seed in enumerate(taken[1:], start=1):
        assert apart[seed, taken[:number]].min() == apart[:, taken[:number]].min(axis=1).max()


def test_as_printed_by_hand() -> None:
    """Three places of one kind, one of another: α is 3/4 and 1/4, and both explain half of what is seen."""
    visible = np.array([[1, 1, 1, 0], [0, 0, 0, 1]], bool)
    s = MixtureSettings(as_printed=True, components=0.5, from_views=1.0, seeds=Seeding.VARIETY)
    np.testing.assert_allclose(match_view(visible, s, rng()).likelihood, np.array([3, 3, 3, 1]) / 10, rtol=1e-12)


@quick
@given(matrices, st.sampled_from(MixtureForm), st.integers(0, 99), st.data())
def test_places_with_the_same_features_are_equally_likely(
    visible: np.ndarray, form: MixtureForm, seed: int, data: st.DataObject
) -> None:
    K = visible.shape[1]
    repeats = np.array(data.draw(st.lists(st.integers(1, 3), min_size=K, max_size=K)))
    match = match_view(np.repeat(visible, repeats, axis=1), MixtureSettings(form=form), rng(seed))
    for places in np.split(match.likelihood, np.cumsum(repeats)[:-1]):
        assert np.ptp(places) == 0


@quick
@given(matrices, st.floats(0.8, 0.95), st.integers(0, 99))
def test_the_penalty_form_of_visible_features_is_the_degenerate_form(
    visible: np.ndarray, cost: float, seed: int
) -> None:
    """(2.14) with one cost for all and nothing said by the invisible ones is (2.15), with cost = (1 − m) / m."""
    # A component for each view, or the weights, no whole numbers, would break ties by their last bit.
    s = MixtureSettings(cost=cost, components=1.0, from_views=1.0)
    penalty = replace(s, form=MixtureForm.PENALTY, visible=1 / (1 + cost))
    one, other = match_view(visible, s, rng(seed)), match_view(visible, penalty, rng(seed))
    np.testing.assert_allclose(one.likelihood, other.likelihood, rtol=1e-9)
    assert (one.failed, one.iterations) == (other.failed, other.iterations)


@quick
@given(matrices, st.sampled_from([MixtureForm.HARD_EM, MixtureForm.COUNTING]), st.integers(0, 99), st.data())
def test_these_forms_look_at_visible_features_only(
    matrix: np.ndarray, form: MixtureForm, seed: int, data: st.DataObject
) -> None:
    n, s = len(matrix), MixtureSettings(form=form)
    observed = np.array(data.draw(st.lists(st.booleans(), min_size=n, max_size=n)), bool)
    whole, reduced = match_view(matrix, s, rng(seed), observed), match_view(matrix[observed], s, rng(seed))
    np.testing.assert_array_equal(whole.likelihood, reduced.likelihood)


@quick
@given(matrices.filter(lambda matrix: matrix.any()), st.floats(0.8, 0.95), st.integers(0, 99))
def test_counting_is_the_degenerate_form_with_every_view_a_component(
    visible: np.ndarray, cost: float, seed: int
) -> None:
    counted = match_view(visible, MixtureSettings(MixtureForm.COUNTING, cost), rng(seed))
    own = MixtureSettings(cost=cost, components=1.0, from_views=1.0)
    np.testing.assert_allclose(counted.likelihood, match_view(visible, own, rng(seed)).likelihood, rtol=1e-9)
    by_hand = np.array([cost ** sum(1 for seen in view if not seen) for view in visible.T])
    np.testing.assert_allclose(counted.likelihood, by_hand / by_hand.sum(), rtol=1e-9)


def test_penalty_of_three_places_by_hand() -> None:
    """With a component each, (2.14) is a product over features that are alike and features that differ."""
    matrix = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 0], [0, 1, 0]], bool)
    s = MixtureSettings(form=MixtureForm.PENALTY, visible=0.9, invisible=0.6, components=1.0, from_views=1.0)
    match = match_view(matrix, s, rng(), observed=np.array([True, True, False, False]))
    joint = np.array([0.9**2 * 0.6**2, 0.9**2 * 0.4**2, 0.9 * 0.1 * 0.6**2])
    np.testing.assert_allclose(match.likelihood, joint / joint.sum(), rtol=1e-12)


def test_a_penalty_that_says_nothing_leaves_all_places_alike() -> None:
    s = MixtureSettings(form=MixtureForm.PENALTY, visible=0.5, invisible=0.5)
    match = match_view(np.eye(4, dtype=bool), s, rng())
    assert match.failed
    np.testing.assert_array_equal(match.likelihood, np.full(4, 1 / 4))


def test_the_bernoulli_form_of_two_places_by_hand() -> None:
    """One component is the mean of both views, and explains both alike; two are kept from certainty by the limit."""
    visible = np.array([[1, 1], [1, 0], [1, 0], [1, 0]], bool)
    s = MixtureSettings(form=MixtureForm.BERNOULLI, limit=0.1, components=1.0, from_views=1.0, tolerance=1e-9)
    match = match_view(visible, s, rng())
    assert not match.failed
    p = np.array([0.9**4, 0.9 * 0.1**3])  # of the column of ones, under either component
    z = np.array([[0.9**4, 0.9 * 0.1**3], [0.9 * 0.1**3, 0.9**4]])
    joint = (z / z.sum(axis=1, keepdims=True)) @ p
    np.testing.assert_allclose(match.likelihood, joint / joint.sum(), atol=1e-3)
    alone = match_view(visible, replace(s, components=0.5), rng())
    np.testing.assert_allclose(alone.likelihood, [0.5, 0.5], rtol=1e-12)


def test_without_a_limit_the_bernoulli_form_calls_an_unseen_combination_impossible() -> None:
    visible = np.repeat(np.eye(3, dtype=bool), 60, axis=0)
    s = MixtureSettings(form=MixtureForm.BERNOULLI, limit=0.0, components=1.0, from_views=1.0)
    match = match_view(visible, s, rng())
    assert (match.failed, match.iterations < s.iterations) == (True, True)
    np.testing.assert_array_equal(match.likelihood, np.full(3, 1 / 3))
    assert not match_view(visible, replace(s, limit=0.1), rng()).failed


@pytest.mark.parametrize("form", [form for form in MixtureForm if form is not MixtureForm.COUNTING])
def test_the_bound_on_components_binds_beyond_it_only(form: MixtureForm) -> None:
    visible = rng(4).random((30, 40)) < 0.3
    s = MixtureSettings(form=form, iterations=50)
    free, bound = (match_view(visible, replace(s, most=most), rng(1)).likelihood for most in (1000, 20))
    np.testing.assert_array_equal(free, bound)
    few = match_view(visible, replace(s, most=5), rng(1))
    same = match_view(visible, replace(s, components=5 / 40), rng(1))
    np.testing.assert_array_equal(few.likelihood, same.likelihood)
    assert not np.array_equal(few.likelihood, free)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"visible": 0.4}, "mixture.visible is 0.4; valid is at least 0.5 and less than 1.0"),
        ({"invisible": 1.0}, "mixture.invisible is 1.0; valid is at least 0.5 and less than 1.0"),
        ({"limit": float("nan")}, "mixture.limit is nan; valid is at least 0.0 and less than 0.5"),
    ],
)
def test_probabilities_that_make_no_sense_are_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        MixtureSettings(**values)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("visible", "failed"),
    [
        (np.zeros((0, 4), bool), True),
        (np.zeros((3, 4), bool), True),
        (np.ones((3, 4), bool), False),
        (np.ones((3, 1), bool), False),
    ],
    ids=["no feature", "feature of no place", "all", "one view"],
)
def test_nothing_to_tell_apart_is_uniform(visible: np.ndarray, failed: bool) -> None:
    match = match_view(visible, DEFAULTS, rng())
    assert_distribution(match, visible.shape[1])
    assert np.ptp(match.likelihood) == 0
    assert match.failed == failed


def test_an_em_that_does_not_settle_answers_uniformly() -> None:
    visible = rng(1).random((20, 12)) < 0.4
    match = match_view(visible, MixtureSettings(iterations=1), rng())
    assert (match.failed, match.iterations) == (True, 1)
    np.testing.assert_array_equal(match.likelihood, np.full(12, 1 / 12))


@pytest.mark.parametrize("form", MixtureForm)
@pytest.mark.parametrize("seed", range(5))
def test_the_view_with_the_features_wins(seed: int, form: MixtureForm) -> None:
    """A view that shows what only place 7 has, and noise that all places share a little."""
    visible = rng(seed).random((30, 20)) < 0.1
    visible[:15] = False
    visible[:15, 7] = True
    likelihood = match_view(visible, MixtureSettings(form=form), rng(seed)).likelihood
    assert np.argmax(likelihood) == 7
    assert likelihood[7] > 0.3


def test_likelihood_of_two_places_by_hand() -> None:
    """Place 0 has all four features, place 1 one of them: they differ by cost to the power of three."""
    visible = np.array([[1, 1], [1, 0], [1, 0], [1, 0]], bool)
    match = match_view(visible, MixtureSettings(cost=0.8, components=1.0, from_views=1.0), rng())
    np.testing.assert_allclose(match.likelihood, np.array([1, 0.8**3]) / (1 + 0.8**3), rtol=1e-12)


def test_two_complementary_kinds_of_places_are_recovered() -> None:
    """The toy matrix of 2.3.2, as far as it fits the degenerate mixture: flipped bits are averaged away."""
    clean = np.repeat(np.array([[1] * 10 + [0] * 10, [0] * 10 + [1] * 10], bool).T, (13, 12), axis=1)
    noisy = clean ^ (rng(3).random(clean.shape) < 0.05)
    visible = noisy[:10]  # the observed view shows the first ten features
    likelihood = match_view(visible, MixtureSettings(components=0.08, from_views=1.0), rng()).likelihood
    assert likelihood[:13].sum() > 0.85
    assert np.ptp(likelihood[:13]) == pytest.approx(0.0)


def test_the_same_seed_gives_the_same_answer_and_random_components_depend_on_it() -> None:
    visible = rng(8).random((40, 30)) < 0.3
    s = MixtureSettings(from_views=0.2)
    first, again = match_view(visible, s, rng(1)), match_view(visible, s, rng(1))
    np.testing.assert_array_equal(first.likelihood, again.likelihood)
    others = [match_view(visible, s, rng(seed)).likelihood for seed in range(2, 6)]
    assert any(not np.array_equal(first.likelihood, other) for other in others)


def test_the_average_view_is_compared_as_places_are() -> None:
    """Each place its own component: the likelihoods are cost^(features that differ), the average's too (1.4.3)."""
    visible = (rng(2).random((9, 5)) < 0.4)[:, [0, 1, 1, 2, 3, 3, 3, 4]]  # each place counts, also those that are alike
    places = DEFAULTS.cost ** (~visible).sum(axis=0).astype(float)
    average = DEFAULTS.cost ** (1 - visible.mean(axis=1)).sum()
    for form in (MixtureForm.HARD_EM, MixtureForm.COUNTING):
        match = match_view(visible, replace(DEFAULTS, form=form, components=1.0, from_views=1.0), rng())
        np.testing.assert_allclose(match.likelihood, places / places.sum())
        assert np.exp(match.log_average) == pytest.approx(average / places.sum())


def test_one_bernoulli_component_is_the_average_view() -> None:
    """All places are then as likely as it is."""
    visible, K = rng(4).random((7, 10)) < 0.5, 10
    one = MixtureSettings(form=MixtureForm.BERNOULLI, components=0.01, limit=0.01, iterations=200)
    match = match_view(visible, one, rng(), rng(5).random(7) < 0.5)
    assert not match.failed
    assert match.log_average == pytest.approx(-np.log(K))


def test_of_a_view_without_features_the_average_is_as_likely_as_a_place() -> None:
    assert match_view(np.zeros((0, 5), np.bool_), DEFAULTS, rng()).log_average == pytest.approx(-np.log(5))
