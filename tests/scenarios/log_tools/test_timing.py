import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.log_tools.timing import Timing, TopicClock


def timing(stamps, logged=None) -> Timing:
    clock = TopicClock()
    for stamp, time in zip(stamps, stamps if logged is None else logged, strict=True):
        clock.add(stamp, time)
    return clock.timing()


def test_a_regular_clock_has_its_rate_and_no_jitter():
    found = timing(100.0 + 0.1 * np.arange(50))
    assert found.rate == pytest.approx(10.0)
    assert found.jitter == pytest.approx(0.0, abs=1e-9)
    assert (found.gaps, found.backwards, found.duplicates, found.zeros) == ((), 0, 0, 0)
    assert found.duration == pytest.approx(4.9)


def test_a_pause_is_told_with_its_place_and_does_not_change_the_rate():
    times = 0.1 * np.arange(60)
    times[40:] += 3.0
    found = timing(times)
    assert found.rate == pytest.approx(10.0)
    assert len(found.gaps) == 1
    assert found.longest_gap.start == pytest.approx(3.9)
    assert found.longest_gap.length == pytest.approx(3.1)


def test_a_slow_sensor_does_not_pause_between_its_messages():
    assert timing(2.0 * np.arange(10)).gaps == ()


def test_jumps_duplicates_and_stamps_of_zero_are_counted():
    found = timing([1.0, 1.1, 1.1, 0.9, 1.2, math.nan, 1.4], [1.0, 1.1, 1.1, 1.15, 1.2, 1.3, 1.4])
    assert (found.backwards, found.duplicates, found.zeros) == (1, 1, 1)


def test_the_delay_is_that_of_logging_after_the_stamp():
    stamps = np.arange(20.0)
    assert timing(stamps, stamps + 0.25).delay == pytest.approx(0.25)


@given(st.floats(0.001, 10), st.floats(-1e6, 2e9), st.integers(2, 60))
def test_rate_and_duration_do_not_depend_on_when_the_log_was_made(period, start, count):
    found = timing(start + period * np.arange(count))
    assert found.rate == pytest.approx(1 / period, rel=1e-2)
    assert found.duration == pytest.approx(period * (count - 1), rel=1e-3)


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_messages_tell_no_rate(count):
    found = timing([5.0] * count)
    assert found.count == count
    assert math.isnan(found.rate)
    assert found.gaps == ()
