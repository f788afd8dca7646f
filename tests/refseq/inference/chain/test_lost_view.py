import numpy as np
import pytest

from refseq.belief import normalised_entropy
from refseq.inference.chain.lost_view import NO_SYMBOL, HeldOutViews, LostViewSymbol, renormalised


def held_out(beside: list[float], elsewhere: list[float]) -> HeldOutViews:
    return HeldOutViews(np.arange(9.0), 4.0, beside, elsewhere)


def test_the_threshold_lies_between_kinds_that_can_be_told_apart() -> None:
    symbol = held_out([0.1, 0.2, 0.3], [0.7, 0.8]).symbol()
    assert symbol.threshold == pytest.approx(0.5)
    assert symbol.at_place == pytest.approx(1 / 5), "none of three, and one more above and below"
    assert symbol.at_lost == pytest.approx(3 / 4)


@pytest.mark.parametrize("seed", range(8))
def test_no_other_threshold_tells_them_apart_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    beside, elsewhere = rng.beta(2, 3, 25), rng.beta(3, 2, 18)
    found = held_out(list(beside), list(elsewhere)).symbol().threshold
    grid = np.linspace(0, 1, 2001)
    youden = [(elsewhere > one).mean() - (beside > one).mean() for one in grid]
    assert (elsewhere > found).mean() - (beside > found).mean() >= max(youden) - 1e-12


def test_views_are_compared_with_places_not_their_own() -> None:
    """Places 2 m apart: beside it the view of place 2 knows four places, elsewhere the two more than 3 m away."""
    likelihood = np.array([0.01, 0.02, 0.9, 0.06, 0.01])
    views = HeldOutViews(2.0 * np.arange(5), 3.0)
    views.add(2, likelihood)
    assert views.beside == [pytest.approx(normalised_entropy(np.array([0.1, 0.2, 0.6, 0.1])))]
    assert views.elsewhere == [pytest.approx(1.0)]


@pytest.mark.parametrize("K", [1, 2, 5])
def test_a_path_without_places_elsewhere_teaches_nothing(K: int) -> None:
    views = HeldOutViews(np.arange(float(K)), 10.0)
    for place in range(K):
        views.add(place, np.full(K, 1 / K))
    assert views.symbol() == NO_SYMBOL
    for distribution in (np.full(8, 1 / 8), np.eye(8)[0]):
        place, lost = views.symbol().log_likelihoods(distribution)
        assert place == lost


def test_the_symbol_is_shown_above_its_threshold() -> None:
    symbol = LostViewSymbol(0.5, 0.1, 0.7)
    assert np.exp(symbol.log_likelihoods(np.full(4, 0.25))) == pytest.approx([0.1, 0.7])
    assert np.exp(symbol.log_likelihoods(np.eye(4)[1])) == pytest.approx([0.9, 0.3])


def test_likelihoods_that_are_too_small_say_nothing() -> None:
    np.testing.assert_array_equal(renormalised(np.zeros(4)), np.full(4, 0.25))
    np.testing.assert_allclose(renormalised(np.array([1e-300, 3e-300])), [0.25, 0.75])
