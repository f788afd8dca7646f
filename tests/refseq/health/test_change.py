import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.health.change import DECLARE, MOST, RECOVER, ChangeTest, Moment, gaussian

RATIOS = st.floats(-MOST, MOST)


@given(st.lists(st.tuples(RATIOS, RATIOS), min_size=1, max_size=12))
def test_the_score_is_the_best_over_all_views_at_which_the_change_may_have_come(ratios):
    test = ChangeTest()
    for number, (ratio, change) in enumerate(ratios):
        test.update(Moment(number, 0.1 * number), ratio, change)
    scores = {t: ratios[t][1] + math.fsum(ratio for ratio, _ in ratios[t + 1 :]) for t in range(len(ratios))}
    assert test.score == pytest.approx(max(scores.values()), abs=1e-9)
    assert scores[test.since.view] == pytest.approx(test.score, abs=1e-9)


def test_a_healthy_sensor_with_honest_ratios_is_declared_less_than_once_in_ten_thousand_views():
    # Ratios of N(1, 1) to N(0, 1) under N(0, 1): x − ½.
    rng, test, declared = np.random.default_rng(1), ChangeTest(), 0
    for number, x in enumerate(rng.standard_normal(100_000)):
        test.update(Moment(number, 0.1 * number), float(x) - 0.5)
        if test.due:
            declared += 1
            test.restart()
    assert declared <= 10


def test_the_same_ratios_under_the_fault_declare_it_soon_and_tell_its_beginning():
    rng, test = np.random.default_rng(1), ChangeTest()
    for number in range(200):
        test.update(Moment(number, 0.1 * number), float(rng.standard_normal() + (2 if number >= 100 else 0)) * 2 - 2)
        if test.due:
            break
    assert 100 < number < 112
    assert abs(test.since.view - 100) <= 2


def test_what_stood_is_taken_back_when_as_much_speaks_for_health():
    test = ChangeTest()
    test.update(Moment(0, 0.0), DECLARE)
    assert test.due
    test.turn_over()
    assert test.declared
    test.update(Moment(1, 0.0), 3.0)
    assert not test.due
    test.update(Moment(2, 0.0), -RECOVER)
    assert test.due


def test_the_ratio_of_two_normal_densities():
    density = lambda x, mean, sigma: math.exp(-(((x - mean) / sigma) ** 2) / 2) / (sigma * math.sqrt(2 * math.pi))  # noqa: E731
    assert gaussian(0.7, (1.0, 0.5), (0.0, 2.0)) == pytest.approx(math.log(density(0.7, 1, 0.5) / density(0.7, 0, 2)))
