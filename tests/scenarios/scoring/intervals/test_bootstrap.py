import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench.scenarios.scoring.intervals.bootstrap import MOST_EXACT, interval_over_runs, resamples
from refseq_bench.scenarios.scoring.proportion import Proportion

RUNS = st.lists(st.integers(1, 9).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))), min_size=2, max_size=4)


@settings(max_examples=25, deadline=None)
@given(RUNS)
def test_it_is_the_middle_of_all_draws_counted_one_by_one(counts: Sequence[tuple[int, int]]) -> None:
    drawn = itertools.product(counts, repeat=len(counts))
    values = sorted(sum(right for right, _ in one) / sum(views for _, views in one) for one in drawn)
    low, high = (values[max(math.ceil(share * len(values) - 1e-9) - 1, 0)] for share in (0.025, 0.975))
    assert interval_over_runs([Proportion(*one) for one in counts]) == pytest.approx((low, high))


@pytest.mark.parametrize("count", [2, 5, MOST_EXACT])
def test_resamples_are_all_there_are(count: int) -> None:
    found = dict(resamples(count))
    assert len(found) == math.comb(2 * count - 1, count)
    assert math.fsum(found.values()) == pytest.approx(1)
    assert found[(0,) * count] == pytest.approx(count**-count)
    assert found[tuple(range(count))] == pytest.approx(math.factorial(count) / count**count)


def test_many_runs_are_drawn_the_same_way_each_time() -> None:
    assert list(resamples(8)) == list(resamples(8))
    runs = [Proportion(right, 10) for right in (2, 3, 5, 5, 6, 7, 8, 9)]
    low, high = interval_over_runs(runs) or (math.nan, math.nan)
    # The mean of 8 shares has a standard error of 0.078: the middle 95 % are about ±1.96 of it.
    assert (low, high) == pytest.approx((0.5625 - 0.155, 0.5625 + 0.155), abs=0.03)


def test_one_run_tells_nothing_of_others() -> None:
    assert interval_over_runs([Proportion(3, 4)]) is None
    assert interval_over_runs([]) is None


def test_runs_without_trials_have_no_interval_of_their_own() -> None:
    assert interval_over_runs([Proportion(0, 0)] * 2) is None
    assert interval_over_runs([Proportion(0, 0), Proportion(2, 2)]) == (1.0, 1.0)


def test_runs_that_agree_have_no_width() -> None:
    assert interval_over_runs([Proportion(3, 4)] * 5) == (0.75, 0.75)
    assert np.isfinite(interval_over_runs([Proportion(0, 4)] * 5) or math.nan).all()
