"""Moments of sensors with rates of their own: which there are, and whose sample each is, by hand."""

import numpy as np
import pytest

from refseq.logs.pairing.moments import NONE, default_tolerance, numbered, paired, slowest

TENTHS, SECONDS = np.arange(0, 10, 0.1), np.arange(0.0, 10.0)


def test_the_slowest_sensor_leads_that_lasts_for_half_of_the_log() -> None:
    """One of few samples at its beginning would make the rest of the log one pause."""
    assert slowest({"fast": TENTHS, "slow": SECONDS, "soon over": np.array([0.0, 2.0])}) == "slow"
    assert slowest({"fast": TENTHS, "slow": SECONDS, "long enough": np.arange(0, 7, 2.0)}) == "long enough"


def test_of_nearly_equal_rates_the_first_leads() -> None:
    assert slowest({"first": np.arange(0, 10, 0.9), "second": SECONDS}) == "first"
    assert slowest({"first": np.arange(0, 10, 0.7), "second": SECONDS}) == "second"


@pytest.mark.parametrize(("period", "tolerance"), [(0.1, 0.05), (0.5, 0.25), (2.0, 0.25)])
def test_the_tolerance_is_half_a_period_and_a_quarter_of_a_second_at_most(period: float, tolerance: float) -> None:
    assert default_tolerance(np.arange(5) * period) == pytest.approx(tolerance)


def test_a_sample_that_is_nearest_to_several_moments_belongs_to_the_nearer_one() -> None:
    found = paired({"camera": np.array([0.0, 1.0, 1.02]), "laser": np.array([1.03])}, "camera", 0.1)
    assert found.samples["laser"].tolist() == [NONE, NONE, 0]
    found = paired({"camera": np.array([0.0, 1.0, 1.04]), "laser": np.array([1.01])}, "camera", 0.1)
    assert found.samples["laser"].tolist() == [NONE, 0, NONE]


def test_of_several_samples_of_one_number_the_last_counts() -> None:
    found = numbered({"camera": [7, 7, 8]}, {"camera": [0.0, 1.0, 2.0]})
    assert found.numbers.tolist() == [7, 8]
    assert found.samples["camera"].tolist() == [1, 2]
    assert found.times.tolist() == [1.0, 2.0]


def test_in_a_pause_another_sensor_leads_no_faster_than_the_one_that_pauses() -> None:
    """Of a laser each 0.3 s from 2 s to 8 s: the first that is more than 1 s behind the camera, and on, 1 s apart."""
    camera = np.array([0.0, 1.0, 2.0, 8.0, 9.0, 10.0])
    found = paired({"camera": camera, "laser": 2 + 0.3 * np.arange(21)}, "camera", 0.1)
    assert found.times == pytest.approx([0, 1, 2, 3.2, 4.4, 5.6, 6.8, 8, 9, 10])
    assert found.samples["camera"].tolist() == [0, 1, 2, NONE, NONE, NONE, NONE, 3, 4, 5]
    assert found.samples["laser"].tolist() == [NONE, NONE, 0, 4, 8, 12, 16, 20, NONE, NONE]
