import numpy as np
import pytest

from refseq_bench.sim.cameras.exposure import (
    Exposure,
    ExposureControl,
    centre_weights,
    split_exposure,
    wanted_exposure,
)
from refseq_bench.sim.errors import SimError

CONTROL = ExposureControl()


def even(signal: float) -> np.ndarray:
    """Zones that gather ``signal`` of full scale in a second."""
    return np.full((60, 80), signal)


@pytest.mark.parametrize("signal", [0.5, 5.0, 50.0, 1000.0])
def test_an_even_scene_gets_the_exposure_that_makes_it_the_target(signal: float) -> None:
    assert wanted_exposure(CONTROL, even(signal)) == pytest.approx(CONTROL.target / signal, rel=1e-6)


def test_the_exposure_falls_with_light_within_its_limits_and_the_shutter_comes_before_the_gain() -> None:
    products = [wanted_exposure(CONTROL, even(signal)) for signal in np.logspace(-6, 6, 61)]
    exposures = [split_exposure(CONTROL, product) for product in products]
    shutters, gains = [e.shutter for e in exposures], [e.gain for e in exposures]
    assert (np.diff(products) <= 1e-9).all()
    assert (min(shutters), max(shutters)) == pytest.approx(CONTROL.shutter)
    assert (min(gains), max(gains)) == pytest.approx(CONTROL.gain)
    assert all(e.gain == 1.0 or e.shutter == pytest.approx(1 / 15) for e in exposures)
    assert [e.product for e in exposures] == pytest.approx(products, rel=1e-9)


def test_a_shorter_limit_of_the_shutter_is_paid_with_gain() -> None:
    short = ExposureControl(shutter=(1e-4, 1 / 60))
    product = 1 / 30
    assert split_exposure(CONTROL, product).gain == 1.0
    assert split_exposure(short, product).gain == pytest.approx(2.0)
    assert split_exposure(short, product).shutter == pytest.approx(1 / 60)


def test_what_the_camera_cannot_do_is_split_into_the_nearest_that_it_can() -> None:
    (short, long), (quiet, loud) = CONTROL.shutter, CONTROL.gain
    assert split_exposure(CONTROL, 2 * long * loud) == Exposure(long, loud)
    assert split_exposure(CONTROL, short * quiet / 2) == Exposure(short, quiet)


def test_a_zone_beyond_full_scale_counts_as_full_scale() -> None:
    # A tenth of the weight burnt out, whatever its light, leaves 0.18 - 0.1 for the rest.
    weights = centre_weights(60, 80)
    burnt = np.zeros((60, 80), bool)
    burnt.ravel()[np.flatnonzero(np.cumsum(weights.ravel()) < 0.1)] = True
    share = weights[burnt].sum()
    for sun in (1e3, 1e6):
        wanted = wanted_exposure(CONTROL, np.where(burnt, sun, 5.0))
        assert wanted == pytest.approx((0.18 - share) / (1 - share) / 5.0, rel=1e-6)


def test_the_centre_of_the_picture_counts_most() -> None:
    weights = centre_weights(48, 64)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[24, 32] > 2.5 * weights[24, 0]


def test_impossible_figures_are_named() -> None:
    with pytest.raises(SimError, match=r"^exposure\.gain = \(4\.0, 2\.0\) is not 0 < least <= most$"):
        ExposureControl(gain=(4.0, 2.0))
    with pytest.raises(SimError, match=r"^exposure\.target = 1\.0 is not > 0 and < 1$"):
        ExposureControl(target=1.0)
    with pytest.raises(SimError, match=r"^exposure\.lag = 0\.0 is not > 0 and <= 60 s$"):
        ExposureControl(lag=0.0)
