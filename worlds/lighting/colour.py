"""Response of a grey silicon camera to lamps of other colours than daylight: electrons for each lumen.

Lamps and daylight are taken for black bodies. The camera's quantum efficiency is flat from 400 to 700 nm, where its
infrared filter ends: a choice. The eye's curve V(λ) is the analytic fit of Wyman, Sloan and Shirley, 'Simple analytic
approximations to the CIE XYZ color matching functions' (JCGT 2013), their ȳ with two lobes (tag M).
"""

from functools import cache

import numpy as np

from refseq_bench.worlds.arrays import Floats

DAYLIGHT = 6500.0
"""Colour temperature of the light that the camera is calibrated with [K]: an overcast sky (facts, tag M)."""
BAND = (400.0, 700.0)
"""Wavelengths that the camera sees [nm]."""
SECOND_RADIATION = 1.438777e7
"""h c / k of Planck's law [nm K]."""


def eye(wavelength: Floats) -> Floats:
    """Return V(λ), the eye's sensitivity by day, for wavelengths in [nm]."""
    return 0.821 * _lobe(wavelength, 568.8, 46.9, 40.5) + 0.286 * _lobe(wavelength, 530.9, 16.3, 31.1)


def _lobe(wavelength: Floats, peak: float, left: float, right: float) -> Floats:
    return np.exp(-0.5 * ((wavelength - peak) / np.where(wavelength < peak, left, right)) ** 2)


def black_body(wavelength: Floats, kelvin: float) -> Floats:
    """Return the power of a black body by wavelength [nm], on a scale of its own (Planck)."""
    return wavelength**-5.0 / np.expm1(SECOND_RADIATION / (wavelength * kelvin))


@cache
def camera_weight(kelvin: float) -> float:
    """Return electrons per lumen of light of that colour temperature [K], over those of daylight."""
    return _electrons_per_lumen(kelvin) / _electrons_per_lumen(DAYLIGHT)


def _electrons_per_lumen(kelvin: float) -> float:
    visible = np.arange(360.0, 831.0)
    seen = visible[(visible >= BAND[0]) & (visible <= BAND[1])]
    photons = np.trapezoid(seen * black_body(seen, kelvin), seen)  # a photon's energy goes with 1 / λ
    return float(photons / np.trapezoid(eye(visible) * black_body(visible, kelvin), visible))
