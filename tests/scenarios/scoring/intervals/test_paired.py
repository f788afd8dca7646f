import math
from collections.abc import Iterable
from itertools import product
from statistics import mean, stdev

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.scoring.intervals.paired import (
    PairedDifference,
    comparisons_shown,
    holm,
    least_p,
    paired_difference,
)


def compared(ours: Iterable[float], others: Iterable[float], floor: float = 0.0) -> PairedDifference:
    return paired_difference(tuple(map(float, ours)), tuple(map(float, others)), floor)


def by_hand(apart: list[float]) -> float:
    """The p-value by its definition: every resample in a loop."""

    def t(drawn: list[float]) -> float:
        spread, moved = stdev(drawn) / math.sqrt(len(drawn)), abs(mean(drawn))
        return moved / spread if spread > 1e-12 else (math.inf if moved > 1e-12 else 0.0)

    sizes = (math.sqrt(0.5), 1.0, math.sqrt(1.5))
    weights = product([*sizes, *(-size for size in sizes)], repeat=len(apart))
    drawn = [t([w * d for w, d in zip(of_one, apart, strict=True)]) for of_one in weights]
    return sum(one >= t(apart) - 1e-9 for one in drawn) / len(drawn)


@pytest.mark.parametrize("apart", [[0.02, 0.05, -0.01, 0.04], [0.0, 0.0, 0.3], [0.1, 0.2]])
def test_p_is_that_of_all_resamples(apart: list[float]) -> None:
    assert compared(apart, [0.0] * len(apart)).p == pytest.approx(by_hand(apart))


def test_only_differences_count() -> None:
    """Seeds that are hard for both are no spread."""
    hard = [0.9, 0.5, 0.2, 0.7, 0.4]
    better = [share + more for share, more in zip(hard, (0.05, 0.06, 0.05, 0.04, 0.05), strict=True)]
    found = compared(better, hard)
    assert found.difference == pytest.approx(0.05)
    assert found.p < 0.05
    assert found.smallest < 0.05


def test_two_seeds_show_nothing_and_five_show_what_all_agree_on() -> None:
    assert compared([0.9] * 2, [0.1] * 2).smallest == math.inf
    assert compared([0.9] * 2, [0.1] * 2).p == pytest.approx(1 / 6)
    agreed = compared([0.9] * 5, [0.1] * 5, floor=0.01)
    assert (agreed.p, agreed.smallest) == (pytest.approx(6**-4), 0.01)
    assert compared([0.5] * 5, [0.5] * 5).p == 1.0


@pytest.mark.parametrize(("seeds", "shown"), [(1, 0), (2, 0), (3, 1), (4, 10), (5, 64), (6, 388)])
def test_comparisons_that_seeds_can_show(seeds: int, shown: int) -> None:
    assert comparisons_shown(seeds) == shown
    if shown:
        assert holm([least_p(seeds)] * shown)[0] <= 0.05 < holm([least_p(seeds)] * (shown + 1))[0]


def test_smallest_difference_is_where_p_crosses_the_level() -> None:
    """A difference of that size with this spread is shown, one a little smaller is not."""
    apart = np.array([0.02, 0.05, -0.01, 0.04, 0.03])
    smallest = compared(apart, np.zeros(5)).smallest
    centred = apart - apart.mean()
    assert compared(centred + smallest, np.zeros(5)).p <= 0.05
    assert compared(centred + 0.98 * smallest, np.zeros(5)).p > 0.05


def test_smallest_difference_is_shown_by_a_lead_and_by_a_lag() -> None:
    """With one seed far to one side a lead of 8 points would be shown, a lag from 20 on."""
    centred = np.array([-0.05, -0.03, -0.07, -0.06, 0.21])
    smallest = compared(centred, np.zeros(5)).smallest
    assert smallest == pytest.approx(compared(-centred, np.zeros(5)).smallest, abs=1e-3)
    assert max(compared(centred + mean, np.zeros(5)).p for mean in (smallest, -smallest)) <= 0.05
    assert max(compared(centred + mean, np.zeros(5)).p for mean in (0.98 * smallest, -0.98 * smallest)) > 0.05


def test_level_is_kept_where_there_is_no_difference() -> None:
    """Of pairs that do not differ but by chance about one in twenty is shown."""
    rng = np.random.default_rng(7)
    shown = [compared(rng.normal(size=4), np.zeros(4)).p <= 0.05 for _ in range(200)]
    assert np.mean(shown) < 0.08


def test_holm_is_that_of_the_textbook() -> None:
    """Four hypotheses with p = 0.01, 0.04, 0.03, 0.005, of which at 5 % the first and the last are rejected."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_holm_rejects_as_step_by_step(p_values: list[float]) -> None:
    """Its definition: from the least on, as long as p ≤ α / (m − k)."""
    rejected: set[int] = set()
    for rank, index in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        if p_values[index] * (len(p_values) - rank) > 0.05:
            break
        rejected.add(index)
    assert {k for k, p in enumerate(holm(p_values)) if p <= 0.05} == rejected
