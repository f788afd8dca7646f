"""Rank agreement against published figures, and against pairs counted one by one."""

import itertools
import math

import numpy as np
import pytest

from refseq_bench.scenarios.scoring.intervals.rank_agreement import (
    _correlations,
    changed_pairs,
    correlations,
    mean_scores,
    rank_agreement,
)

IQ = [106.0, 100, 86, 101, 99, 103, 97, 113, 112, 110]
TELEVISION = [7.0, 27, 2, 50, 28, 29, 20, 12, 6, 17]
"""Ten people's IQ and hours of television a week, the usual example of Spearman's ρ: −29/165."""
MATHEMATICS = [7.0, 6, 8, 3, 2, 10, 4, 1, 5, 9]
MUSIC = [5.0, 4, 7, 8, 10, 3, 1, 2, 9, 6]


def by_pairs(first: list[float], second: list[float]) -> float:
    """τ-b by its definition."""
    pairs = list(itertools.combinations(range(len(first)), 2))
    orders = [(np.sign(first[a] - first[b]), np.sign(second[a] - second[b])) for a, b in pairs]
    untied = [sum(order[side] != 0 for order in orders) for side in (0, 1)]
    return sum(one * other for one, other in orders) / math.sqrt(untied[0] * untied[1])


def test_spearman_s_rho_is_that_of_a_published_example() -> None:
    assert correlations(np.array(IQ), np.array(TELEVISION))[0] == pytest.approx(-29 / 165)


@pytest.mark.parametrize(
    ("first", "second"), [(IQ, TELEVISION), (MATHEMATICS, MUSIC), ([1.0, 1, 2, 3, 3], [2.0, 1, 1, 5, 4])]
)
def test_kendall_s_tau_is_what_pairs_counted_one_by_one_give(first: list[float], second: list[float]) -> None:
    assert correlations(np.array(first), np.array(second))[1] == pytest.approx(by_pairs(first, second))


def test_the_same_order_agrees_wholly_and_the_opposite_one_not_at_all() -> None:
    scores = np.array([[0.1, 0.2], [0.3, 0.3], [0.5, 0.6], [0.9, 0.8]])
    alike = rank_agreement([scores], [scores**2, scores / 2])
    assert (alike.spearman.value, alike.kendall.value) == pytest.approx((1.0, 1.0))
    assert (alike.alike, alike.pairs) == (6, 6)
    opposite = rank_agreement([scores], [1 - scores])
    assert (opposite.spearman.value, opposite.kendall.value, opposite.alike) == pytest.approx((-1.0, -1.0, 0))


def test_ties_of_a_side_are_no_pairs_and_scores_that_are_all_equal_have_no_order() -> None:
    ours, flat = np.array([[0.1], [0.1], [0.5]]), np.full((3, 1), 0.4)
    assert rank_agreement([ours], [np.array([[1.0], [2.0], [3.0]])]).pairs == 2
    nothing = rank_agreement([ours], [flat])
    assert math.isnan(nothing.spearman.value)
    assert math.isnan(nothing.kendall.low)


def test_the_interval_holds_the_value_and_narrows_with_more_methods() -> None:
    rng = np.random.default_rng(1)
    wide, narrow = (
        rank_agreement([truth := rng.random((count, 1))], [truth + 0.2 * rng.standard_normal((count, 1))])
        for count in (8, 60)
    )
    for found in (wide, narrow):
        assert found.spearman.low <= found.spearman.value <= found.spearman.high
    assert narrow.spearman.high - narrow.spearman.low < wide.spearman.high - wide.spearman.low


def test_runs_that_disagree_widen_the_interval() -> None:
    steady = np.repeat(np.linspace(0, 1, 12)[:, None], 3, axis=1)
    shaky = steady + np.array([-0.5, 0.0, 0.5]) * (-1.0) ** np.arange(12)[:, None]
    assert np.allclose(mean_scores([steady]), mean_scores([shaky]))
    assert rank_agreement([steady], [steady]).kendall.low == pytest.approx(1.0)
    assert rank_agreement([steady], [shaky]).kendall.low < 0.95


def test_pairs_that_change_places_are_all_those_in_opposite_order_the_clearest_first() -> None:
    ours, others = np.array([0.9, 0.5, 0.4, 0.1]), np.array([0.2, 0.8, 0.25, 0.1])
    found = changed_pairs(ours, others)
    assert [(pair.better, pair.worse) for pair in found] == [(0, 1), (0, 2)]
    assert found[0].lead == pytest.approx(0.4)
    assert found[0].lag == pytest.approx(0.6)


def test_many_at_once_are_what_scipy_says_of_each() -> None:
    ours, others = np.random.default_rng(3).integers(0, 5, size=(2, 20, 7)).astype(float)  # with ties
    each = [correlations(*pair) for pair in zip(ours, others, strict=True)]
    np.testing.assert_allclose(_correlations(ours, others), np.transpose(each))
