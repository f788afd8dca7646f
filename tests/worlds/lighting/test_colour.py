import numpy as np
import pytest
from scipy.integrate import quad

from refseq_bench.worlds.lighting.colour import black_body, camera_weight, eye

PEAK = 683.0
"""Luminous efficacy at 555 nm [lm/W], the definition of the lumen."""


def electrons_per_lumen(kelvin: float) -> float:
    """Photons from 400 to 700 nm for each lumen of a black body, by adaptive integration in SI units."""
    h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23

    def power(metres: float) -> float:
        return 2 * h * c**2 / metres**5 / np.expm1(h * c / (metres * k * kelvin))

    def seen(metres: float) -> float:
        return PEAK * power(metres) * float(eye(np.array(metres * 1e9)))

    photons, _ = quad(lambda m: power(m) * m / (h * c), 400e-9, 700e-9, epsabs=0, epsrel=1e-9)
    lumens, _ = quad(seen, 360e-9, 830e-9, points=[530.9e-9, 568.8e-9], epsabs=0, epsrel=1e-9)
    return photons / lumens


def test_daylight_counts_as_it_is() -> None:
    assert camera_weight(6500.0) == 1.0


@pytest.mark.parametrize("kelvin", [2200.0, 2700.0, 4000.0, 5000.0, 10000.0])
def test_weight_is_the_ratio_of_photons_to_lumens(kelvin: float) -> None:
    expected = electrons_per_lumen(kelvin) / electrons_per_lumen(6500.0)
    assert camera_weight(kelvin) == pytest.approx(expected, rel=1e-3)


def test_warm_light_has_more_photons_that_the_eye_hardly_sees() -> None:
    # Red below 4500 K, blue above: a lumen costs least in between.
    warm = [camera_weight(kelvin) for kelvin in (2200, 2700, 3000, 3500, 4000, 4500)]
    cold = [camera_weight(kelvin) for kelvin in (5500, 6500, 8000, 10000)]
    assert (np.diff(warm) < 0).all()
    assert (np.diff(cold) > 0).all()


@pytest.mark.parametrize(
    ("wavelength", "standard"), [(450, 0.038), (510, 0.503), (555, 1.0), (600, 0.631), (650, 0.107)]
)
def test_eye_is_the_standard_observers(wavelength: float, standard: float) -> None:
    # CIE 1931 V(λ), as printed everywhere.
    assert eye(np.array(float(wavelength))) == pytest.approx(standard, abs=0.02)


def test_sunlit_lumen_has_the_energy_that_textbooks_give() -> None:
    # A black body of 5778 K gives about 93 lm/W (all wavelengths).
    visible = np.arange(360.0, 831.0)
    every = np.arange(100.0, 1e5, 5.0)
    total = np.trapezoid(black_body(every, 5778.0), every)
    assert PEAK * np.trapezoid(eye(visible) * black_body(visible, 5778.0), visible) / total == pytest.approx(
        93, rel=0.02
    )
