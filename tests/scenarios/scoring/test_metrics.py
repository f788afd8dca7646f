import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.scoring.metrics import reliability


def test_bins_and_error_by_hand() -> None:
    found = reliability(np.array([0.95, 0.97, 1.0, 0.35, 0.31]), np.array([True, True, False, False, True]))
    assert found.count.tolist() == [0, 0, 0, 2, 0, 0, 0, 0, 0, 3]
    assert found.probability[[3, 9]] == pytest.approx([0.33, 2.92 / 3])
    assert found.share[[3, 9]] == pytest.approx([1 / 2, 2 / 3])
    assert np.isnan(found.probability[0])
    assert np.isnan(found.share[0])
    assert found.error == pytest.approx((abs(2.92 - 2) + abs(0.66 - 1)) / 5)


def test_a_bin_holds_its_lower_edge_and_the_last_both() -> None:
    assert reliability(np.array([0.0, 0.5, 1.0]), np.ones(3, bool), bins=2).count.tolist() == [1, 2]


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=40), st.integers(1, 12))
def test_error_is_the_surplus_of_each_bin(answers: list[tuple[float, bool]], bins: int) -> None:
    found = reliability(np.array([p for p, _ in answers]), np.array([hit for _, hit in answers]), bins)
    gaps = [abs(sum(p - hit for p, hit in answers if min(int(p * bins), bins - 1) == number)) for number in range(bins)]
    assert found.error == pytest.approx(sum(gaps) / len(answers))
    assert found.count.sum() == len(answers)


def test_probabilities_that_come_true_have_a_small_error() -> None:
    rng = np.random.default_rng(1)
    probabilities = rng.random(20_000)
    hits = rng.random(20_000) < probabilities
    assert reliability(probabilities, hits).error < 0.02
    assert reliability(probabilities**0.25, hits).error > 0.2


def test_without_views_there_is_no_error() -> None:
    assert math.isnan(reliability(np.zeros(0), np.zeros(0, bool)).error)
