import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.emissions import MOST_ALIKE, Emissions, Seen
from refseq.inference.chain.lost_view import HeldOutViews, LostView

CHAIN = ChainSettings()


def bare(distribution: np.ndarray) -> Seen:
    """A view whose likelihood alone is observed."""
    return Seen(distribution, distribution)


@pytest.mark.parametrize("K", [1, 2, 7, MOST_ALIKE + 1])
def test_short_sequences_are_kept_exactly(K: int) -> None:
    rng = np.random.default_rng(K)
    similarity = rng.dirichlet(np.full(K, 0.3), K)
    emissions = Emissions.from_posteriors(iter(similarity), CHAIN)
    np.testing.assert_allclose(emissions.similarity, similarity, atol=1e-15)


def test_what_most_places_share_is_not_stored() -> None:
    """A view that shares features with three places of a thousand: the others differ by nothing."""
    K, alike = 1000, np.array([3, 4, 700])
    rows = np.full((K, K), 1e-4)
    rows[:, alike] = (1 - 1e-4 * (K - 3)) * np.array([0.5, 0.3, 0.2])
    emissions = Emissions.from_posteriors(rows, CHAIN)
    assert emissions.above.nnz == 3 * K
    np.testing.assert_allclose(emissions.similarity, rows, atol=1e-15)


@pytest.mark.parametrize("concentration", [0.05, 5.0])
def test_rows_of_long_sequences_keep_their_peaks_and_their_sum(concentration: float) -> None:
    """With the higher concentration more places than are kept stand above the uniform."""
    rng, K = np.random.default_rng(1), 4 * MOST_ALIKE
    rows = rng.dirichlet(np.full(K, concentration), 20)
    emissions = Emissions.from_posteriors(np.vstack([rows, np.eye(K)[20:]]), CHAIN)
    kept = np.diff(emissions.above.indptr)[:20]
    assert kept.max() <= MOST_ALIKE
    similarity = emissions.similarity
    np.testing.assert_allclose(similarity.sum(axis=1), 1.0, rtol=1e-12)
    for row, found, count in zip(rows, similarity, kept, strict=False):
        highest = np.argsort(-row)[:count]
        np.testing.assert_allclose(found[highest], row[highest], rtol=1e-12)
        rest = np.delete(row, highest)
        np.testing.assert_allclose(np.delete(found, highest), rest.mean(), rtol=1e-12)
        assert row[highest].min() > 1 / K
        assert count == MOST_ALIKE or rest.max() <= 1 / K


def test_the_likelihood_is_the_dense_product() -> None:
    rng, K = np.random.default_rng(2), 4 * MOST_ALIKE
    emissions = Emissions.from_posteriors(rng.dirichlet(np.full(K, 0.05), K), CHAIN)
    posterior = rng.dirichlet(np.full(K, 0.02))
    places, _ = emissions.log_likelihood(bare(posterior))
    seen = (1 - CHAIN.noise) * emissions.similarity @ posterior + CHAIN.noise / K
    np.testing.assert_allclose(places, np.log((1 - CHAIN.lost_view_at_place) * seen), atol=1e-12)


@pytest.mark.parametrize("K", [1, 2, 7])
def test_emissions_sum_to_one_over_the_symbols(K: int) -> None:
    emissions = Emissions.from_posteriors(np.random.default_rng(K).dirichlet(np.ones(K), K), CHAIN)
    seen = [emissions.log_likelihood(bare(row)) for row in np.eye(K)]
    places = np.sum([np.exp(place) for place, _ in seen], axis=0)
    lost = sum(math.exp(value) for _, value in seen)
    np.testing.assert_allclose(places + CHAIN.lost_view_at_place, 1.0)
    assert lost + CHAIN.lost_view_at_lost == pytest.approx(1.0)


def test_the_lost_view_is_a_symbol_of_its_own() -> None:
    emissions = Emissions.from_posteriors(np.eye(8), CHAIN)
    uniform = np.full(8, 1 / 8)
    places, lost = emissions.log_likelihood(bare(uniform))
    np.testing.assert_allclose(np.exp(places), CHAIN.lost_view_at_place)
    assert math.exp(lost) == pytest.approx(CHAIN.lost_view_at_lost)


def test_places_stay_possible_where_nothing_is_alike() -> None:
    places, _ = Emissions.from_posteriors(np.eye(5), CHAIN).log_likelihood(bare(np.eye(5)[0]))
    assert np.exp(places[1:]) == pytest.approx((1 - CHAIN.lost_view_at_place) * CHAIN.noise / 5)


@pytest.mark.parametrize("K", [2, 7])
def test_without_a_lost_view_the_views_are_all_symbols_there_are(K: int) -> None:
    settings = replace(CHAIN, lost_view=LostView.NONE)
    emissions = Emissions.from_posteriors(np.random.default_rng(K).dirichlet(np.ones(K), K), settings)
    seen = [emissions.log_likelihood(bare(row)) for row in np.eye(K)]
    np.testing.assert_allclose(np.sum([np.exp(place) for place, _ in seen], axis=0), 1.0)
    assert [math.exp(lost) for _, lost in seen] == pytest.approx([1 / K] * K)
    wide, lost = emissions.log_likelihood(bare(0.99 / K + 0.01 * np.eye(K)[0]))
    assert np.ptp(wide) > 0, "a wide view still tells places apart"
    assert lost == pytest.approx(-math.log(K))


def test_the_average_view_is_the_lost_view_by_its_odds() -> None:
    """Soft evidence: with odds o of the Lost View, each likelihood is (o · that of it + that of the rest) / (o + 1)."""
    settings = replace(CHAIN, lost_view=LostView.AVERAGE)
    rng, K = np.random.default_rng(3), 6
    rows, view = rng.dirichlet(np.ones(K), K), rng.dirichlet(np.ones(K))
    emissions = Emissions.from_posteriors(rows, settings)
    for odds in (0.0, 0.3, 1.0, 50.0):
        places, lost = emissions.log_likelihood(Seen(view, view, math.log(odds) if odds else -math.inf))
        similar = (1 - CHAIN.noise) * rows @ view + CHAIN.noise / K
        np.testing.assert_allclose(np.exp(places), (0.1 * odds + 0.9 * similar) / (odds + 1))
        assert math.exp(lost) == pytest.approx((0.5 * odds + 0.5 / K) / (odds + 1))


@pytest.mark.parametrize("rule", LostView)
def test_a_view_that_is_a_places_is_as_probable_there_as_the_rule_has_it(rule: LostView) -> None:
    """Under each rule no view is the Lost View; what a rule does not use has no part in it."""
    K, along = 12, np.arange(12.0)
    near = np.exp(-np.abs(along[:, None] - along) / 0.5) + 1e-3
    rows = near / near.sum(axis=1, keepdims=True)
    settings = replace(CHAIN, lost_view=rule)
    emissions = Emissions.from_posteriors(rows, settings, HeldOutViews(along, 4.0))
    shares = {
        LostView.NONE: (1.0, 1.0),
        LostView.LEARNT: (1 - emissions.symbol.at_place, 1 - emissions.symbol.at_lost),
    }.get(rule, (0.9, 0.5))
    for view in (np.eye(K)[4], np.full(K, 1 / K)):
        places, lost = emissions.log_likelihood_of_place(view)
        of_places = (1 - CHAIN.noise) * rows @ view + CHAIN.noise / K
        np.testing.assert_allclose(np.exp(places), shares[0] * of_places)
        assert math.exp(lost) == pytest.approx(shares[1] / K)


def test_a_learnt_lost_view_is_told_by_the_view_alone_and_kept_beside_the_places() -> None:
    """A view that the odometer made sure of is the Lost View all the same."""
    K = 12
    near = np.exp(-np.abs(np.arange(K)[:, None] - np.arange(K)) / 0.5) + 1e-3
    rows = near / near.sum(axis=1, keepdims=True)
    settings = replace(CHAIN, lost_view=LostView.LEARNT)
    learnt = Emissions.from_posteriors(rows, settings, HeldOutViews(np.arange(float(K)), 4.0))
    plain = Emissions.from_posteriors(rows, replace(CHAIN, lost_view=LostView.NONE))
    assert learnt.symbol.at_lost > 0.5 > learnt.symbol.at_place
    sure, wide = np.eye(K)[4], np.full(K, 1 / K)
    expected, _ = plain.log_likelihood(bare(sure))
    places, lost = learnt.log_likelihood(Seen(sure, wide))
    np.testing.assert_allclose(places - expected, math.log(learnt.symbol.at_place))
    assert lost == pytest.approx(math.log(learnt.symbol.at_lost / K))
